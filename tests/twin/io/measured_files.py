"""Small sound files of every format, written by the format's own library."""

from pathlib import Path

import h5py
import numpy as np
import pyuff
import scipy.io
import scipy.io.wavfile
from nptdms import ChannelObject, RootObject, TdmsWriter

TIMES = 0.01 * np.arange(50)
POSITION = 0.2 * np.sin(7 * TIMES)
CURRENT = 3.0 * np.cos(7 * TIMES) - 1.0


def csv(path: Path) -> Path:
    rows = "".join(f"{t:.2f};{x!r};{i!r}\n" for t, x, i in zip(TIMES, POSITION.tolist(), CURRENT.tolist(), strict=True))
    path.write_text("t [s];x [mm];i [A]\n" + rows.replace("np.float64", ""), encoding="utf-8")
    return path


def mat(path: Path) -> Path:
    scipy.io.savemat(path, {"t": TIMES, "x": POSITION, "i": CURRENT, "note": "run"}, do_compression=True)
    return path


def mat4(path: Path) -> Path:
    scipy.io.savemat(path, {"t": TIMES, "x": POSITION, "i": CURRENT}, format="4")
    return path


def hdf5(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        for name, values, unit in (("t", TIMES, "s"), ("x", POSITION, "mm"), ("i", CURRENT, "A")):
            file.create_dataset(name, data=values, chunks=(16,), compression="gzip").attrs["unit"] = unit
    return path


def mat73(path: Path) -> Path:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("t", TIMES), ("x", POSITION), ("i", CURRENT)):
            file[name] = values[None]
    content = path.read_bytes()
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(head + content[128:])
    return path


def tdms(path: Path) -> Path:
    with TdmsWriter(path) as writer:
        channels = [
            ChannelObject("run", name, values, {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": unit})
            for name, values, unit in (("x", POSITION, "mm"), ("i", CURRENT, "A"))
        ]
        writer.write_segment([RootObject({"title": "run"}), *channels])
    return path


def wav(path: Path) -> Path:
    scipy.io.wavfile.write(path, 100, np.stack([POSITION, CURRENT / 4], axis=1))
    return path


def npz(path: Path) -> Path:
    np.savez_compressed(path, t=TIMES, x=POSITION, i=CURRENT)
    return path


def npy(path: Path) -> Path:
    np.save(path, np.stack([POSITION, CURRENT], axis=1))
    return path


def uff(path: Path, *, binary: int = 0) -> Path:
    file = pyuff.UFF(str(path))
    for node, values, kind, label in ((1, POSITION, 8, "mm"), (2, CURRENT, 0, "A")):
        function = pyuff.prepare_58(
            binary=binary, func_type=1, rsp_node=node, rsp_dir=1, ref_node=1, ref_dir=1, data=values, x=TIMES,
            id1="run", rsp_ent_name="axis", ref_ent_name="axis", abscissa_spacing=1, abscissa_spec_data_type=17,
            ordinate_spec_data_type=kind, orddenom_spec_data_type=0, ordinate_axis_units_lab=label,
        )  # fmt: skip
        file.write_sets([function], "add")  # its mode "overwrite" loses binary data
    return path


def uff_binary(path: Path) -> Path:
    return uff(path, binary=1)


WRITERS = {
    "run.csv": csv, "run.mat": mat, "run4.mat": mat4, "run73.mat": mat73, "run.h5": hdf5, "run.tdms": tdms,
    "run.wav": wav, "run.npz": npz, "run.npy": npy, "run.uff": uff, "runb.uff": uff_binary,
}  # fmt: skip
