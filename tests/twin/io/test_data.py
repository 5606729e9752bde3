import hashlib
import warnings
import zipfile

import pytest

from twin._checks import InputError
from twin.io import data
from twin.io.data import DataChecksumWarning, DataNotFound, data_file

CONTENT = b"published samples"
NAME = "set/run.mat"


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """No data set in reach, an empty cache, one published file, and a network that counts its calls and fails."""
    source = data._Source(hashlib.sha256(CONTENT).hexdigest(), ("https://one.test/run.mat", "https://two.test/a.zip"))
    monkeypatch.setattr(data, "_SOURCES", {NAME: source})
    monkeypatch.setattr(data, "_cache", lambda: tmp_path / "cache")
    monkeypatch.setattr(data, "__file__", str(tmp_path / "site" / "twin" / "io" / "data.py"))
    monkeypatch.delenv("DRIVETWIN_DATA", raising=False)
    (tmp_path / "home" / "deep").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "home" / "deep")
    network(monkeypatch, {})
    return tmp_path


def network(monkeypatch, pages):
    asked = []

    class Downloader:
        def __init__(self, **settings):
            pass

        def __call__(self, address, output_file, _):
            asked.append(address)
            if address not in pages:
                raise ConnectionError("no route")
            with open(output_file, "wb") as stream:
                stream.write(pages[address])

    monkeypatch.setattr("pooch.HTTPDownloader", Downloader)
    return asked


def put(folder, content=CONTENT):
    (folder / NAME).parent.mkdir(parents=True, exist_ok=True)
    (folder / NAME).write_bytes(content)
    return folder / NAME


def test_environment_comes_first(nowhere, monkeypatch):
    put(nowhere / "home" / "shared" / "data")
    file = put(nowhere / "mine")
    monkeypatch.setenv("DRIVETWIN_DATA", str(nowhere / "mine"))
    assert data_file(NAME) == file


def test_shared_folder_above_the_working_folder(nowhere):
    file = put(nowhere / "home" / "shared" / "data")
    assert data_file(NAME) == file


def test_shared_folder_above_the_package(nowhere):
    file = put(nowhere / "site" / "shared" / "data")
    assert data_file(NAME) == file


def test_environment_that_names_no_folder(nowhere, monkeypatch):
    monkeypatch.setenv("DRIVETWIN_DATA", str(nowhere / "gone"))
    with pytest.raises(DataNotFound, match=r"DRIVETWIN_DATA is set to .*gone.*no folder"):
        data_file(NAME)


def test_nowhere_says_where_it_looked(nowhere):
    with pytest.raises(DataNotFound) as caught:
        data_file(NAME)
    for words in (NAME, "cache", "https://one.test/run.mat", "https://two.test/a.zip", "DRIVETWIN_DATA"):
        assert words in str(caught.value)
    assert isinstance(caught.value, InputError) and isinstance(caught.value, FileNotFoundError)


def test_download_can_be_declined(nowhere, monkeypatch):
    asked = network(monkeypatch, {})
    with pytest.raises(DataNotFound):
        data_file(NAME, download=False)
    assert asked == []


def test_download_fills_the_cache(nowhere, monkeypatch):
    asked = network(monkeypatch, {"https://one.test/run.mat": CONTENT})
    assert data_file(NAME).read_bytes() == CONTENT
    assert data_file(NAME) == nowhere / "cache" / NAME
    assert len(asked) == 1


def test_wrong_page_is_passed_over_for_the_archive(nowhere, monkeypatch):
    with zipfile.ZipFile(nowhere / "a.zip", "w") as archive:
        archive.writestr("EMPS/run.mat", CONTENT)
    pages = {"https://one.test/run.mat": b"<html>", "https://two.test/a.zip": (nowhere / "a.zip").read_bytes()}
    network(monkeypatch, pages)
    assert data_file(NAME).read_bytes() == CONTENT
    assert [each.name for each in (nowhere / "cache" / "set").iterdir()] == ["run.mat"]


def test_download_with_wrong_checksum_is_refused(nowhere, monkeypatch):
    network(monkeypatch, {"https://one.test/run.mat": CONTENT[:-1]})
    with pytest.raises(DataNotFound):
        data_file(NAME)
    assert not (nowhere / "cache" / NAME).exists()


def test_damaged_cache_is_fetched_again(nowhere, monkeypatch):
    put(nowhere / "cache", CONTENT[:3])
    network(monkeypatch, {"https://one.test/run.mat": CONTENT})
    assert data_file(NAME).read_bytes() == CONTENT


def test_local_file_with_another_checksum_warns(nowhere):
    file = put(nowhere / "home" / "shared" / "data", b"edited")
    with pytest.warns(DataChecksumWarning, match=r"run\.mat.*differs from the published"):
        assert data_file(NAME) == file


def test_local_file_that_is_not_published_needs_no_checksum(nowhere):
    folder = nowhere / "home" / "shared" / "data"
    put(folder)
    (folder / "own.csv").write_text("t\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert data_file("own.csv") == folder / "own.csv"
    with pytest.raises(DataNotFound, match=r"none of the known data files \(set/run\.mat\)"):
        data_file("other.csv")


@pytest.mark.parametrize("name", ["", "/etc/passwd", "../secret", "a/../../b"])
def test_name_that_leads_out(nowhere, name):
    with pytest.raises(InputError, match="inside the data folder"):
        data_file(name)


def test_folder_in_place_of_the_file(nowhere):
    (nowhere / "home" / "shared" / "data" / NAME).mkdir(parents=True)
    with pytest.raises(InputError, match="is a folder"):
        data_file(NAME)
