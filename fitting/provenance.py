"""Where numbers come from: versions of what computed them, checksums of what was read."""

import hashlib
import importlib.metadata
import platform
from pathlib import Path

_PACKAGES = ("drivetwin", "jax", "jaxlib", "equinox", "diffrax", "optimistix", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Versions of Python, the platform and the packages that numbers come from."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in _PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def checksum(file: Path) -> dict[str, str]:
    """Name of a file and its SHA-256.

    Args:
        file: the file.
    """
    with file.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return {"file": file.name, "sha256": digest}
