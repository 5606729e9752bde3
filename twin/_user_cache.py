"""Where this package may keep what it can fetch or make again: the user's cache folder."""

from pathlib import Path


def user_cache() -> Path:
    """Folder for this package in the user's cache; it need not exist."""
    import platformdirs

    return platformdirs.user_cache_path("drivetwin")
