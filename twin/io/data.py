"""Where the measured data sets lie: a folder named by the environment, one beside the checkout, or a download cache."""

import hashlib
import os
import warnings
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from twin._checks import InputError
from twin._user_cache import user_cache

_VARIABLE = "DRIVETWIN_DATA"
_TIMEOUT = 15.0
_EMPS_ARCHIVES = (
    "https://drive.google.com/uc?export=download&id=1zwoXYa9-3f8NQ0ohzmjpF7UxbNgRTHkS",
    "https://www.nonlinearbenchmark.org/FILES/BENCHMARKS/EMPS/EMPS.zip",
)
_EMPS_PAGE = "https://www.nonlinearbenchmark.org/benchmarks/emps"
_BENCH_FOLDER = (
    "https://raw.githubusercontent.com/WataruOhnishi/FdiTools_Python/"
    "c4280f2b6f5525fbc0350449fae0df735b0a7b4a/MATLAB/Examples/private"
)
_OLD_BENCH_FOLDERS = {
    "A": "https://raw.githubusercontent.com/HoriFujimotoLab/FdiTools/"
    "b9dd1445b6d0619098a2376feb8356cdad4991cc/Examples/private",
    "B": "https://raw.githubusercontent.com/HoriFujimotoLab/FdiTools/"
    "d641fe81493ec368c176beccc919d5185640b07d/Examples/private",
}
_BENCH_PAGE = "https://github.com/WataruOhnishi/FdiTools_Python"


class DataNotFound(InputError, FileNotFoundError):
    """A measured data set is neither here nor to be had: the message says where it was looked for and what to do."""


class DataChecksumWarning(UserWarning):
    """A data file differs from the published one."""


@dataclass(frozen=True)
class _Source:
    """Where one published file comes from."""

    sha256: str
    """Checksum of the file."""
    addresses: tuple[str, ...] = ()
    """Addresses of the file, or of a ZIP archive with the file in it, in the order to try; none if not published."""
    page: str = ""
    """Page on which a reader finds the data set."""


_SOURCES = {
    "emps/DATA_EMPS.mat": _Source(
        "6cf6814ae14618795da0101aae2bb97ff0c6351b0501b5492751b02b07facf7e", _EMPS_ARCHIVES, _EMPS_PAGE
    ),
    "emps/DATA_EMPS_PULSES.mat": _Source(
        "0eab75bb1f6b16228ee78791343a88bf9bfd9a51036ac9807d7b5fc11c0e1704", _EMPS_ARCHIVES, _EMPS_PAGE
    ),
    "two_inertia_bench/MultisineTypeA.mat": _Source(
        "a15dadc2e756ceddd927935f9c4c547cdcaef95c8611fc39087c848b3a8acb26",
        (f"{_BENCH_FOLDER}/MultisineTypeA.mat", f"{_OLD_BENCH_FOLDERS['A']}/MultisineTypeA.mat"),
        _BENCH_PAGE,
    ),
    "two_inertia_bench/MultisineTypeB.mat": _Source(
        "5618374be2c4c9c4eef5b180eb5bc64c82c5bd216c025d363b547d0ccc83dc11",
        (f"{_BENCH_FOLDER}/MultisineTypeB.mat", f"{_OLD_BENCH_FOLDERS['B']}/MultisineTypeB.mat"),
        _BENCH_PAGE,
    ),
    "nist_strd/nist_strd.json": _Source("7ffceb4716246b3eeff3389107025728e30cd0cdde774da18ac91855cae7fe47"),
}


def data_file(name: str, *, download: bool = True) -> Path:
    """Find a measured data file.

    Looked for in this order: the folder that the environment variable DRIVETWIN_DATA names; `shared/data` in the
    working folder or any folder above it, then in those above this package; the user's cache; the published address,
    from where it is put into the cache. What is downloaded must have the published checksum; a local file that has not
    is used with a warning.

    Args:
        name: path inside the data folder with forward slashes, such as "emps/DATA_EMPS.mat".
        download: whether to try the published address.

    Returns:
        Path of the file.

    Raises:
        DataNotFound: if the file is found nowhere, or DRIVETWIN_DATA names no folder.
        InputError: if the name leads out of the data folder, or what bears the name is not a readable file.
    """
    if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts or not name:
        raise InputError(
            f"name must be a path inside the data folder, but is {name!r}. Use one of: {', '.join(_SOURCES)}."
        )
    looked = []
    for folder in _folders():
        file = folder / name
        if file.exists():
            _check_file(file, name)
            return file
        looked.append(str(folder))
    cached = _cache() / name
    source = _SOURCES.get(name)
    if source and cached.is_file() and _sha256(cached) == source.sha256:
        return cached
    looked.append(str(_cache()))
    if source and download:
        for address in source.addresses:
            if _download(address, cached, source.sha256):
                return cached
            looked.append(address)
    raise DataNotFound(_not_found(name, source, looked))


def _folders() -> Iterator[Path]:
    named = os.environ.get(_VARIABLE)
    if named:
        folder = Path(named).expanduser()
        if not folder.is_dir():
            raise DataNotFound(
                f"the environment variable {_VARIABLE} is set to {named!r}, which is no folder. "
                "Set it to the folder that holds the data sets, or unset it."
            )
        yield folder
    seen = set()
    for start in (Path.cwd(), Path(__file__).resolve().parents[2]):
        for above in (start, *start.parents):
            folder = above / "shared" / "data"
            if folder not in seen and folder.is_dir():
                seen.add(folder)
                yield folder


def _check_file(file: Path, name: str) -> None:
    if not file.is_file():
        raise InputError(
            f"data file {str(file)!r} is a folder, but a file is expected. Remove it or copy the file there."
        )
    try:
        found = _sha256(file)
    except OSError as error:
        raise InputError(f"data file {str(file)!r} cannot be read: {error}. Check its permissions.") from error
    if name in _SOURCES and found != _SOURCES[name].sha256:
        warnings.warn(
            f"data file {str(file)!r} differs from the published one (sha256 {found[:12]}…, published "
            f"{_SOURCES[name].sha256[:12]}…): results may not compare with published ones. Fetch it again if in doubt.",
            DataChecksumWarning,
            stacklevel=3,
        )


def _cache() -> Path:
    return user_cache()


def _download(address: str, target: Path, sha256: str) -> bool:
    """Whether the file could be fetched from the address, had the right checksum, and now lies in the cache."""
    import pooch

    fetched = target.with_name(f".{target.name}.{os.getpid()}.download")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        pooch.HTTPDownloader(timeout=_TIMEOUT)(address, str(fetched), None)
        if zipfile.is_zipfile(fetched):
            _unpack(fetched, target.name)
        if _sha256(fetched) != sha256:
            return False
        fetched.replace(target)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):  # network errors are OSErrors
        return False
    finally:
        fetched.unlink(missing_ok=True)
    return True


def _unpack(archive: Path, name: str) -> None:
    with zipfile.ZipFile(archive) as members:
        member = next((each for each in members.namelist() if PurePosixPath(each).name == name), None)
        if member is None:
            raise KeyError(name)
        content = members.read(member)
    archive.write_bytes(content)


def _sha256(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _not_found(name: str, source: _Source | None, looked: list[str]) -> str:
    known = "" if source else f" It is none of the known data files ({', '.join(_SOURCES)})."
    page = f"download it from {source.page} and " if source and source.page else ""
    return (
        f"data file {name!r} was not found; looked in {', '.join(looked)}.{known} To supply it, {page}"
        f"set the environment variable {_VARIABLE} to the folder that holds {name!r}."
    )
