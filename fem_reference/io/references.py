"""What a mesh file may name: other files, in its own folder only; and its XML, without entities."""

from pathlib import Path
from xml.etree import ElementTree

# A document of ours defines no entities: they can multiply a text a billion times, or stand for other files.
_FORBIDDEN = (b"<!DOCTYPE", b"<!ENTITY")


def beside(path: Path, name: str) -> Path:
    """The file ``name`` that the file at ``path`` refers to; ValueError where that, links followed, is not in its folder."""
    found = path.parent / name
    if not found.resolve().is_relative_to(path.parent.resolve()):
        raise ValueError(f'a reference to "{name}", outside the folder of the file')
    return found


def parsed_xml(path: Path) -> ElementTree.Element:
    """The root of an XML file; ValueError where it defines entities."""
    text = path.read_bytes()
    check_no_entities(text)
    return ElementTree.fromstring(text)


def check_no_entities(text: bytes) -> None:
    """ValueError where an XML text has a document type."""
    if any(one in text for one in _FORBIDDEN):
        raise ValueError("a document type, which no mesh file needs")
