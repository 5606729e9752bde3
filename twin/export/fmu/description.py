"""The description of an FMU in XML, for FMI 2.0 and FMI 3.0."""

from xml.sax.saxutils import quoteattr

from twin.export.fmu.variables import Layout, Variable

_SOURCES = ("fmi{version}.c", "model.c")


def source_names(version: str) -> tuple[str, ...]:
    """Names of the files that are compiled.

    Args:
        version: "2.0" or "3.0".
    """
    return tuple(name.format(version=version[0]) for name in _SOURCES)


def model_description(
    version: str, name: str, identifier: str, token: str, places: Layout, period: float, description: str
) -> str:
    """Text of modelDescription.xml.

    Args:
        version: "2.0" or "3.0".
        name: name of the model.
        identifier: name of its library.
        token: what library and description know each other by.
        places: the variables.
        period: length of a step [s].
        description: what the model is.
    """
    two = version == "2.0"
    listed = [(place, v) for place, v in enumerate(places.variables) if v.listed]
    state = "canGetAndSetFMUstate" if two else "canGetAndSetFMUState"
    head = {"fmiVersion": version, "modelName": name, "guid" if two else "instantiationToken": token}
    head |= {"description": description, "generationTool": "drivetwin", "variableNamingConvention": "flat"}
    abilities = {"modelIdentifier": identifier, "canHandleVariableCommunicationStepSize": "true", state: "true"}
    abilities[state.replace("GetAndSet", "Serialize")] = "true"
    if not two:
        abilities["fixedInternalStepSize"] = repr(period)
    sources = [f"<File{_attributes({'name': file})}/>" for file in source_names(version)] if two else []
    names = sorted({v.unit for _, v in listed if v.unit})
    units = [f"<Unit{_attributes({'name': unit})}/>" for unit in names]
    category = {"name": "logStatusError", "description": "Why a call failed"}
    experiment = {"startTime": "0.0", "stopTime": repr(1000 * period), "stepSize": repr(period)}
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<fmiModelDescription{_attributes(head)}>",
        *_element("CoSimulation", abilities, _element("SourceFiles", {}, sources) if two else []),
        *(_element("UnitDefinitions", {}, units) if units else []),
        *_element("LogCategories", {}, [f"<Category{_attributes(category)}/>"]),
        f"<DefaultExperiment{_attributes(experiment)}/>",
        *_element("ModelVariables", {}, [line for place, v in listed for line in _variable(two, place, v)]),
        *_element("ModelStructure", {}, _structure(two, listed)),
        "</fmiModelDescription>",
    ]
    return "\n".join(lines) + "\n"


def build_description(version: str, identifier: str) -> str:
    """Text of sources/buildDescription.xml, which FMI 3.0 has beside the source code.

    Args:
        version: "3.0".
        identifier: name of the library.
    """
    files = [f"<SourceFile{_attributes({'name': name})}/>" for name in source_names(version)]
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<fmiBuildDescription fmiVersion="{version}">',
        *_element(
            "BuildConfiguration", {"modelIdentifier": identifier}, _element("SourceFileSet", {"language": "C99"}, files)
        ),
        "</fmiBuildDescription>",
    ]
    return "\n".join(lines) + "\n"


def _attributes(given: dict[str, str]) -> str:
    return "".join(f" {key}={quoteattr(value)}" for key, value in given.items() if value)


def _element(name: str, attributes: dict[str, str], inside: list[str]) -> list[str]:
    if not inside:
        return [f"<{name}{_attributes(attributes)}/>"]
    return [f"<{name}{_attributes(attributes)}>", *(f"  {line}" for line in inside), f"</{name}>"]


def _variable(two: bool, place: int, v: Variable) -> list[str]:
    if two and v.causality == "independent":
        return _element(
            "ScalarVariable",
            {"name": v.name, "valueReference": str(place), "causality": v.causality, "variability": v.variability},
            [f"<Real{_attributes({'unit': v.unit})}/>"],
        )
    common = {"name": v.name, "valueReference": str(place), "description": v.description}
    common |= {"causality": v.causality, "variability": v.variability}
    if v.causality == "parameter":
        common["initial"] = "exact"
    elif v.causality in ("output", "local"):
        common["initial"] = "calculated"
    own = {"unit": v.unit, "start": "" if v.start is None else repr(v.start)}
    if two:
        return _element("ScalarVariable", common, [f"<Real{_attributes(own)}/>"])
    return [f"<Float64{_attributes(common | own)}/>"]


def _structure(two: bool, listed: list[tuple[int, Variable]]) -> list[str]:
    """Outputs with the inputs that act on them at once, so that tools see which loops are algebraic."""
    # FMI 2 counts the variables in the file from one, FMI 3 goes by value references.
    mark = {place: str(number if two else place) for number, (place, _) in enumerate(listed, start=1)}
    outputs = [(mark[place], " ".join(mark[i] for i in v.inputs)) for place, v in listed if v.causality == "output"]
    key = "index" if two else "valueReference"
    if not two:
        lines = [f'<Output valueReference="{at}" dependencies="{through}"/>' for at, through in outputs]
        return lines + [f'<InitialUnknown valueReference="{at}"/>' for at, _ in outputs]
    return [
        *_element("Outputs", {}, [f'<Unknown {key}="{at}" dependencies="{through}"/>' for at, through in outputs]),
        *_element("InitialUnknowns", {}, [f'<Unknown {key}="{at}"/>' for at, _ in outputs]),
    ]
