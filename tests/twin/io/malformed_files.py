"""Files that no reader may trust, made in a folder: each must be refused, and none may run code or take memory."""

import functools
import os
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import scipy.io

from tests.twin.io import measured_files as made

WITNESS = "it_ran"
FILES: dict[str, Callable[[Path], object]] = {}
_NOISE = np.random.default_rng(11).integers(0, 256, 5000, dtype=np.uint8).tobytes()


class Bomb:
    """Whoever unpickles it leaves a witness behind."""

    def __reduce__(self):
        return os.mkdir, (WITNESS,)


def content(name: str):
    """Register what writes the file of that name, or the bytes it holds."""

    def keep(make):
        FILES[name] = make
        return make

    return keep


def _bytes(name: str, data: bytes) -> None:
    FILES[name] = lambda path: path.write_bytes(data)


def _cut(path: Path, name: str, kept: float) -> None:
    whole = made.WRITERS[name](path.with_name(f"whole_{name}")).read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))])


for _name in made.WRITERS:
    if not _name.endswith("csv"):
        for _kept in (0.1, 0.45, 0.93):
            FILES[f"cut_{_kept}_{_name}"] = functools.partial(_cut, name=_name, kept=_kept)
for _ending in ("csv", "mat", "uff", "h5", "tdms", "wav", "npz", "npy", "txt", "bin"):
    _bytes(f"noise.{_ending}", _NOISE)
    _bytes(f"empty.{_ending}", b"")
    _bytes(f"zeros.{_ending}", bytes(3000))
    _bytes(f"pickle.{_ending}", pickle.dumps(Bomb()))
_MAT5 = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
_TAILS = {
    "mat": _MAT5, "h5": b"\x89HDF\r\n\x1a\n", "tdms": b"TDSm", "wav": b"RIFF\xff\xff\xff\x7fWAVEfmt ",
    "npz": b"PK\x03\x04x.npy", "npy": b"\x93NUMPY", "uff": b"    -1\n    58\n",
}  # fmt: skip
for _ending, _head in _TAILS.items():
    _bytes(f"head_then_noise.{_ending}", _head + _NOISE)
    _bytes(f"only_head.{_ending}", _head)

_bytes("words.csv", b"these are words\nand no table\n" * 30)
_bytes("one_row.csv", b"t;x\n1;2\n")
_bytes("headings_only.csv", b"t;x;y\n")
_bytes("bad_cell.csv", b"t;x\n" + b"".join(b"%d;%d\n" % (k, k) for k in range(600)) + b"600;oops\n601;5\n" * 9)
_bytes("short_row.csv", b"t;x;y\n" + b"1;2;3\n" * 50 + b"4;5\n" + b"1;2;3\n" * 50)
_bytes("long_row.csv", b"t;x;y\n" + b"1;2;3\n" * 50 + b"4;5;6;7\n" + b"1;2;3\n" * 50)
_bytes("null_inside.csv", b"t;x\n" + b"1;2\n" * 30 + b"\x00\x01\x02\n" + b"1;2\n" * 3000)
_bytes("wrong_utf8.csv", b"\xef\xbb\xbft;x\n" + b"1;2\n" * 3000 + b"\xff\xfe;1\n")
_bytes("odd_utf16.csv", b"\xff\xfe" + "t;x\n1;2\n".encode("utf-16-le") * 20 + b"\xd8")
_bytes("one_long_line.csv", b"1;" * 1_200_000)
_bytes("many_columns.csv", (b";".join([b"1"] * 30_000) + b"\n") * 12)
_bytes("open_quote.csv", b't;x\n1;2\n"3;4\n' + b"5;6\n" * 50)
_bytes("clock_then_words.csv", b"time;x\n" + b"12:00:01;1\n" * 20 + b"noon;2\n" + b"12:00:01;1\n" * 20)
_bytes("impossible_date.csv", b"time;x\n" + b"".join(b"2024-02-%02d;1\n" % k for k in range(20, 40)))


def _element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def _matrix(kind: int, shape: tuple[int, ...], rest: bytes, name: bytes = b"x") -> bytes:
    head = _element(6, struct.pack("<II", kind, 0)) + _element(5, struct.pack(f"<{len(shape)}i", *shape))
    return _element(14, head + _element(1, name) + rest)


_bytes("huge.mat", _MAT5 + _matrix(6, (1 << 30, 1 << 10), _element(9, bytes(64))))
_bytes("huge_cell.mat", _MAT5 + _matrix(1, (1 << 30, 1), b""))
_bytes("negative.mat", _MAT5 + _matrix(6, (-1, -8), _element(9, bytes(64))))
_bytes("huge_element.mat", _MAT5 + struct.pack("<II", 14, 0xFFFFFFF0) + bytes(200))
_bytes("huge4.mat", struct.pack("<5i", 0, 1 << 30, 1 << 20, 0, 2) + b"x\0" + bytes(80))
_bytes("names.mat", _MAT5 + _matrix(2, (1, 1), _element(5, struct.pack("<i", 0)) + _element(1, b"a")))
_bytes("zip_bomb.mat", _MAT5 + struct.pack("<II", 15, 3_000_000) + zlib.compress(bytes(3_000_000_000 // 500), 9))


@content("deep.mat")
def _deep(path: Path) -> None:
    inner = _matrix(6, (1, 1), _element(9, bytes(8)), b"")
    for _ in range(3000):
        inner = _matrix(1, (1, 1), inner, b"")
    path.write_bytes(_MAT5 + inner)


@content("deep_packed.mat")
def _deep_packed(path: Path) -> None:
    _deep(path)
    packed = zlib.compress(path.read_bytes()[128:])
    path.write_bytes(_MAT5 + struct.pack("<II", 15, len(packed)) + packed)


@content("only_text.mat")
def _only_text(path: Path) -> None:
    scipy.io.savemat(path, {"note": "words", "state": pickle.dumps(Bomb()).decode("latin-1")})


@content("objects.npz")
def _objects(path: Path) -> None:
    np.savez(path, t=made.TIMES, x=np.array([Bomb(), None], dtype=object))


@content("objects.npy")
def _object(path: Path) -> None:
    np.save(path, np.array([Bomb()], dtype=object))


def _npy(shape: str, data: bytes, kind: str = "<f8") -> bytes:
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + data


_bytes("huge.npy", _npy("(1000000000000,)", bytes(80)))
_bytes("negative.npy", _npy("(-5,)", bytes(80)))
_bytes("code.npy", _npy(f"(__import__('os').mkdir('{WITNESS}'),)", bytes(80)))
_bytes("deep.npy", _npy("(" * 40 + ")" * 40, bytes(80)))
_bytes("text.npy", _npy("(10,)", bytes(80), "|S8"))


def _zip(path: Path, **members: bytes) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)


FILES["huge.npz"] = lambda path: _zip(path, x=_npy("(1000000000000,)", bytes(80)))
FILES["wrong_member.npz"] = lambda path: _zip(path, x=_NOISE)
FILES["text_only.npz"] = lambda path: _zip(path, x=_npy("(10,)", bytes(80), "|S8"))


@content("zip_bomb.npz")
def _zip_bomb(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        block = bytes(1 << 20)
        with archive.open("x.npy", "w", force_zip64=True) as member:
            member.write(_npy("(8000000,)", b""))
            for _ in range(61):
                member.write(block)


@content("lying.npz")
def _lying(path: Path) -> None:
    _zip(path, x=_npy("(10,)", bytes(80)))
    data = bytearray(path.read_bytes())
    at = data.index(b"PK\x01\x02")
    data[at + 24 : at + 28] = struct.pack("<I", 0xFFFFFF00)
    path.write_bytes(data)


@content("links.h5")
def _links(path: Path) -> None:
    made.hdf5(path.with_name("secret.h5"))
    with h5py.File(path, "w") as file:
        file["a"], file["b"] = h5py.ExternalLink("secret.h5", "x"), h5py.SoftLink("/c")
        file["c"], file["../d"] = h5py.SoftLink("/b"), h5py.ExternalLink("../secret.h5", "x")


@content("outside.h5")
def _outside(path: Path) -> None:
    path.with_name("secret.bin").write_bytes(bytes(800))
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (100,), "f8", external=[("secret.bin", 0, 800)])


@content("virtual.h5")
def _virtual(path: Path) -> None:
    made.hdf5(path.with_name("secret.h5"))
    layout = h5py.VirtualLayout((50,), "f8")
    layout[:] = h5py.VirtualSource("secret.h5", "x", (50,))
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("x", layout)


@content("huge.h5")
def _huge(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (1 << 44,), "f8", chunks=(1 << 16,))


@content("huge_chunk.h5")
def _huge_chunk(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (1000,), "f8", chunks=(1 << 28,), maxshape=(None,))


@content("deep.h5")
def _deep_groups(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["/".join("g" * 1 for _ in range(60)) + "/x"] = made.TIMES


@content("cycle.h5")
def _cycle(path: Path) -> None:
    with h5py.File(path, "w") as file:
        group = file.create_group("a")
        group["again"], group["b"] = file["/"], group


@content("strings.h5")
def _strings(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["x"] = ["words", "more"]


@content("references.mat")
def _references(path: Path) -> None:
    made.mat73(path)
    with h5py.File(path, "r+") as file:
        for name in list(file):
            del file[name]
        file["x"] = np.array([file.ref] * 3, dtype=h5py.ref_dtype)
        file["x"].attrs["matlab_class"] = np.bytes_("cell")


def _broken_text(path: Path, which: int, declared: int) -> None:
    with h5py.File(path, "w") as file:
        file["x"], file["time"] = made.TIMES, made.TIMES
        file["x"].attrs["unit"] = "m" * 29
    whole = bytearray(path.read_bytes())
    length = struct.pack("<I", 29)
    at = whole.index(length, whole.index(length) + 1 if which else 0)
    whole[at : at + 4] = struct.pack("<I", declared)
    path.write_bytes(bytes(whole))


@content("endless_heap.h5")  # libhdf5 2.0 never comes back
def _endless_heap(path: Path) -> None:
    _broken_text(path, 1, 200)


@content("huge_text.h5")
def _huge_text(path: Path) -> None:
    _broken_text(path, 0, 0xFFFFFFF0)


def _wav(
    size: int, *, channels: int = 1, rate: int = 100, bits: int = 16, align: int = 2, data: bytes = bytes(40)
) -> bytes:
    body = b"WAVEfmt " + struct.pack("<IHHIIHH", 16, 1, channels, rate, rate * align, align, bits)
    return (
        b"RIFF" + struct.pack("<I", len(body) + 8 + size & 0xFFFFFFFF) + body + b"data" + struct.pack("<I", size) + data
    )


_bytes("huge.wav", _wav(0xFFFFFF00))
_bytes("no_channels.wav", _wav(40, channels=0))
_bytes("many_channels.wav", _wav(40, channels=60000, align=60000))
_bytes("no_align.wav", _wav(40, align=0))
_bytes("no_rate.wav", _wav(40, rate=0))
_bytes("no_data.wav", _wav(0, data=b""))


def _tdms(index: bytes, *, size: int = 80, objects: int = 1) -> bytes:
    path = b"/'g'/'x'"
    meta = struct.pack("<I", objects) + struct.pack("<I", len(path)) + path + index + struct.pack("<I", 0)
    head = b"TDSm" + struct.pack("<IIQQ", 0b1110, 4713, len(meta) + size, len(meta))
    return head + meta + bytes(80)


_bytes("huge.tdms", _tdms(struct.pack("<IIIQ", 20, 10, 1, 1 << 60)))
_bytes("huge_offset.tdms", _tdms(struct.pack("<IIIQ", 20, 10, 1, 10), size=1 << 50))
_bytes("many_objects.tdms", _tdms(struct.pack("<IIIQ", 20, 10, 1, 10), objects=0xFFFFFFFF))
_bytes("odd_type.tdms", _tdms(struct.pack("<IIIQ", 20, 0x7777, 1, 10)))


def _uff(change: Callable[[str], str]) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        path.write_text(change(made.uff(path.with_name(f"whole_{path.name}")).read_text()))

    return write


FILES["more_points.uff"] = _uff(lambda text: text.replace("        50         1", " 999999999         1"))
FILES["words.uff"] = _uff(lambda text: text.replace("e-01", "word"))
FILES["no_function.uff"] = _uff(lambda text: text.replace("\n    58 ", "\n   151 "))
FILES["open_end.uff"] = _uff(lambda text: text.rstrip().removesuffix("-1"))
FILES["no_kind.uff"] = _uff(lambda text: text.replace("\n    58 ", "\n   abc "))
