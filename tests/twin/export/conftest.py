"""FMUs that several tests read."""

import pytest
from export_cases import CASES

from twin.export import write_fmu


@pytest.fixture(scope="session")
def written(tmp_path_factory):
    """Writes each case once for each version, and gives its file."""
    folder, files = tmp_path_factory.mktemp("fmus"), {}

    def write(case, version):
        if (case, version) not in files:
            system, _, times, _, stepping = CASES[case]()
            path = folder / f"{case}_{version[0]}.fmu"
            period = None if case.endswith("loop") else float(times[1])
            files[case, version] = write_fmu(path, system, period=period, stepping=stepping, version=version)
        return files[case, version]

    return write
