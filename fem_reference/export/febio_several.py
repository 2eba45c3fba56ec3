"""Several muscles in one input file of FEBio: the model of each muscle with its bones, and contact between the muscles."""

from xml.etree.ElementTree import Element

from fem_reference.export import febio, febio_contact, febio_mesh
from fem_reference.geometry.interpenetration import penetration, skin_of
from fem_reference.problems.muscles import MusclesProblem

# The attributes that contain names, and the tags whose text is a name.
_ATTRIBUTES = ("name", "mat", "node_set", "elem_set", "surface_pair")
_TEXTS = ("primary", "secondary", "rb")
# The entries that are numbered across all muscles, with the kind of number, and the entries whose text consists of node numbers.
_NUMBERED = {"node": "node", "elem": "elem", "material": "material", "load_controller": "curve"}
_OF_NODES = ("elem", "tri3", "tri6", "NodeSet")
_ONCE = ("Module", "Control")  # sections that are the same for all muscles
_ORDER = (*_ONCE, "Material", "Mesh", "MeshDomains", "MeshData", "Boundary", "Rigid", "Contact", "LoadData", "Output")
_FIRST = ("Nodes", "Elements")  # the entries that must precede all others in a mesh


def model(problem: MusclesProblem) -> Element:
    """The root element of the complete input file. Names begin with the name of the muscle, as in ``deep_muscle``."""
    root = Element("febio_spec", version="4.0")
    sections = {tag: Element(tag) for tag in _ORDER}
    before = dict.fromkeys(_NUMBERED.values(), 0)
    for name, one in problem.problems.items():
        own = febio.model(one)
        mesh = febio_mesh.Mesh(one)
        mesh.surface(_found(own, "Mesh"), "touching", "tri6", mesh.curved(one.body.mesh.facets["free"]))
        _renamed(own, name, before)
        for section in own:
            if section.tag in sections:  # the comments for all muscles are added below
                _add(sections[section.tag], section)
    first = next(iter(problem.problems.values()))
    febio.add_comments(root, (febio.units(first.frames[0]), *notes(problem)))
    _touch(sections, problem)
    sections["Mesh"][:] = sorted(sections["Mesh"], key=lambda one: one.tag not in _FIRST)
    root.extend(one for one in sections.values() if len(one) or one.attrib)
    return root


def _found(root: Element, tag: str) -> Element:
    """The first entry with this ``tag``, which must exist."""
    found = root.find(tag)
    assert found is not None
    return found


def _add(known: Element, more: Element) -> None:
    """Add the entries of the section ``more`` of another muscle to ``known``; of an output section, only the logged data."""
    if known.tag in _ONCE and (len(known) or known.attrib):
        return
    known.attrib |= more.attrib
    if known.tag == "Output" and len(known):
        _found(known, "logfile").extend(_found(more, "logfile"))
    else:
        known.extend(more)


def _renamed(root: Element, name: str, before: dict[str, int]) -> None:
    """Prefix all names in the model of a muscle with its ``name``, and renumber its entries.

    ``before``: the highest numbers of the preceding muscles, by kind, which are updated.
    """
    most = dict(before)
    for entry in root.iter():
        for key in set(_ATTRIBUTES) & set(entry.keys()):
            entry.set(key, f"{name}_{entry.get(key)}")
        if entry.tag in _TEXTS:
            entry.text = f"{name}_{entry.text}"
        if entry.tag in _OF_NODES:
            entry.text = ",".join(str(int(node) + before["node"]) for node in str(entry.text).split(","))
        if entry.tag in _NUMBERED:
            kind = _NUMBERED[entry.tag]
            number = int(entry.get("id", "")) + before[kind]
            most[kind] = max(most[kind], number)
            entry.set("id", str(number))
        if curve := entry.get("lc"):
            entry.set("lc", str(int(curve) + before["curve"]))
        if entry.tag == "node_data":
            entry.set("file", f"nodes_{name}.txt")
    before |= most


def _touch(sections: dict[str, Element], problem: MusclesProblem) -> None:
    """Add contact between each pair of muscles that may touch, in two passes, each with half the stiffness, as in the reference."""
    if not problem.pairs:
        return
    assert problem.law is not None  # there are pairs only with a law of contact
    for k, (one, other) in enumerate(problem.pairs):
        name = f"touching_{k}_{one}_{other}"
        febio_mesh.Mesh.pair(sections["Mesh"], f"{name}_pair", f"{one}_touching", f"{other}_touching")
        settings = {"penalty": problem.law.stiffness / 2, "search_radius": febio_contact.SEARCH_RADIUS, "two_pass": 1}
        friction = {"fric_coeff": problem.law.friction or 0.0}
        febio_contact.pair(sections["Contact"], "sliding-elastic", name, settings | friction)
    solver = _found(sections["Control"], "solver")
    if solver.find("symmetric_stiffness") is None:
        febio_mesh.leaf(solver, "symmetric_stiffness", "non-symmetric")


def notes(problem: MusclesProblem) -> list[str]:
    """Sentences about differences between FEBio's model and the reference, for each muscle and for contact between muscles."""
    own = [f"{name}: {text}" for name, one in problem.problems.items() for text in febio_contact.notes(one)]
    between = list[str]()
    for one, other in problem.pairs:
        depth, _ = penetration(*(skin_of(problem.problems[name].mesh) for name in (one, other)))
        rest = (
            f"an overlap of {depth:.2g} mm at rest is removed at once" if depth > 0 else "they do not overlap at rest"
        )
        between.append(f"{one} and {other} touch by FEBio's law, which is linear and has no smoothing; {rest}")
    return own + between
