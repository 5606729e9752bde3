"""WAV: sampled sound, and whatever else is recorded by a sound card."""

import struct
from pathlib import Path

from twin._checks import InputError
from twin.io.formats._abscissa import even_times
from twin.io.formats._shared import check_room
from twin.io.measurement import MeasuredChannel

ENDINGS = (".wav",)
_MOST_CHANNELS = 256


def matches(head: bytes) -> int:
    """Whether these first bytes are those of a WAV file."""
    return 2 if head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE" else 0


def read(
    file: Path,
    limit: int,
    *,
    scale: float | list[float] | tuple[float, ...] = 1.0,
    unit: str | list[str] | tuple[str, ...] = "",
    names: list[str] | tuple[str, ...] | None = None,
) -> tuple[list[MeasuredChannel], list[str]]:
    """Read the channels; whole numbers are scaled to the range from -1 to 1.

    Args:
        file: the file.
        limit: bytes that may be read.
        scale: what full scale (1) means, in the unit; one for all channels or one each.
        unit: unit of the scaled samples; one for all channels or one each.
        names: names of the channels; None numbers them.

    Raises:
        InputError: a damaged or cut file, or not as many scales, units or names as channels.
    """
    import scipy.io.wavfile  # a quarter of a second to import

    _check_chunks(file)
    check_room(file.stat().st_size, limit, file, "samples")
    rate, samples = scipy.io.wavfile.read(file)
    if rate <= 0 or samples.size == 0:
        raise InputError(f"WAV file {str(file)!r} has {samples.size} samples at {rate} Hz. Export it again.")
    samples = samples.reshape(samples.shape[0], -1)
    check_room(samples.size * 8, limit, file, "samples")
    remarks = [f"The sample rate is {rate} Hz, as the file says."]
    factor, offset = 1.0, 0.0
    if samples.dtype.kind in "iu":
        span = 2.0 ** (8 * samples.dtype.itemsize - 1)
        factor, offset = 1 / span, (-1.0 if samples.dtype.kind == "u" else 0.0)
        remarks.append(f"{samples.dtype.name} samples are scaled to the range from -1 to 1.")
    count = samples.shape[1]
    scales, units = _each(scale, count, "scale"), _each(unit, count, "unit")
    called = _each(names or [f"channel {number}" for number in range(1, count + 1)], count, "names")
    times = even_times(samples.shape[0], 1 / rate)
    channels = [
        MeasuredChannel(
            str(called[i]), (samples[:, i] * factor + offset) * float(scales[i]), str(units[i]), times, "time"
        )
        for i in range(count)
    ]
    return channels, remarks


def _each(given: object, count: int, what: str) -> list:
    if isinstance(given, str | float | int):
        return [given] * count
    listed = list(given) if isinstance(given, list | tuple) else []
    if len(listed) != count:
        raise InputError(f"{what} has {len(listed)} entries, but the file has {count} channels. Give one each.")
    return listed


def _check_chunks(file: Path) -> None:
    """Raise unless the data is all there: SciPy would allocate what the header declares."""
    size = file.stat().st_size
    with file.open("rb") as opened:
        head = opened.read(12)
        order = ">" if head[:4] == b"RIFX" else "<"
        start, data = 12, False
        while start + 8 <= size:
            opened.seek(start)
            kind, length = struct.unpack(f"{order}4sI", opened.read(8))
            if head[:4] == b"RF64" and kind == b"data" and length == 0xFFFFFFFF:
                length = size - start - 8
            if length > size - start - 8:
                raise InputError(
                    f"WAV file {str(file)!r} declares {length} bytes for {kind!r}, but {size - start - 8} are left: it "
                    "is cut short. Copy or export it again."
                )
            if kind == b"fmt ":
                fields = struct.unpack(f"{order}HHIIHH", opened.read(16)) if length >= 16 else (0,) * 6
                if not 0 < fields[1] <= _MOST_CHANNELS or fields[2] == 0 or fields[4] == 0:
                    raise InputError(f"WAV file {str(file)!r} has a damaged header. Copy or export it again.")
            data = data or kind == b"data"
            start += 8 + length + length % 2
    if not data:
        raise InputError(f"WAV file {str(file)!r} holds no samples. Copy or export it again.")
