"""How time grows with variants, parameters, masses and starts, and what side-by-side streams gain."""

from tests.benchmarks import scaling, scaling_report, scaling_streams
from tests.benchmarks.sections import Options, Section


def section(options: Options) -> Section:
    """All curves with their pictures, and the streams."""
    sizes = scaling.SHORT if options.short else scaling.Sizes()
    curves, study = scaling.all_curves(sizes), scaling_streams.streams(sizes.streamed)
    pictures = scaling_report.write_pictures(curves, options.out)
    earlier = ((options.earlier or {}).get("scaling") or {}).get("curves")
    text = scaling_report.as_markdown(curves, pictures, earlier) + "\n" + scaling_streams.as_markdown(study)
    results = {"curves": scaling.as_dictionary(curves), "streams": scaling_streams.as_dictionary(study)}
    return Section(text, results, scaling_streams.summary_rows(study))
