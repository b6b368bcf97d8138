"""XML with the line of each element."""

from __future__ import annotations

from collections.abc import Iterator
from xml.parsers import expat

from msgspec import Struct, field


class NotRead(Exception):
    """Why a file is not carried over, with the line of the file, 0 where it is the whole."""

    def __init__(self, message: str, line: int = 0, help: str = "") -> None:
        super().__init__(message)
        self.message, self.line, self.help = message, line, help


class XmlElement(Struct):
    """An element; ``seen``: the attributes and children that somebody asked for, the rest was not carried over."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[XmlElement] = field(default_factory=list)
    seen: set[str] = field(default_factory=set)

    def all(self, tag: str) -> list[XmlElement]:
        self.seen.add(tag)
        return [child for child in self.children if child.tag == tag]

    def one(self, tag: str) -> XmlElement | None:
        """Return the only child of a name. Raises NotRead where there are several."""
        found = self.all(tag)
        if len(found) > 1:
            raise NotRead(f"'{self.tag}' has {len(found)} elements '{tag}'", found[1].line)
        return found[0] if found else None

    def get(self, name: str, default: str = "") -> str:
        self.seen.add(name)
        return self.attributes.get(name, default)

    def need(self, name: str) -> str:
        """Return an attribute. Raises NotRead where it is missing."""
        if name not in self.attributes:
            raise NotRead(f"'{self.tag}' has no '{name}'", self.line)
        return self.get(name)

    def number(self, name: str, default: float | None = None) -> float:
        """Return an attribute that is a number. Raises NotRead."""
        if name not in self.attributes and default is not None:
            self.seen.add(name)
            return default
        return self._numbers(name, self.need(name))[0]

    def numbers(self, name: str, count: int, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return an attribute of several numbers. Raises NotRead."""
        if not self.get(name).strip():
            return default
        found = self._numbers(name, self.get(name))
        if len(found) != count:
            raise NotRead(f"'{name}' of '{self.tag}' has {len(found)} numbers, not {count}", self.line)
        return found

    def _numbers(self, name: str, text: str) -> tuple[float, ...]:
        try:
            found = tuple(float(word) for word in text.split())
        except ValueError:
            found = ()
        if not found or any(value != value or abs(value) == float("inf") for value in found):
            raise NotRead(f"'{name}' of '{self.tag}' is '{text}', which is not a number", self.line)
        return found

    def unseen(self) -> Iterator[tuple[str, int]]:
        """Yield what nobody asked for: attributes and elements inside, with their lines."""
        for name in self.attributes:
            if name not in self.seen and name != "name" and ":" not in name:
                yield f"{name} of {self.tag}", self.line
        for child in self.children:
            if child.tag in self.seen:
                yield from child.unseen()
            else:
                yield child.tag, child.line


def read_xml(text: str) -> XmlElement:
    """Return the root of a text. Raises NotRead."""
    top = XmlElement("", {}, 0)
    stack = [top]
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        element = XmlElement(tag, attributes, parser.CurrentLineNumber)
        stack[-1].children.append(element)
        stack.append(element)

    def refuse_entity(*_: object) -> None:
        raise NotRead("the file defines entities of XML, which are not read", parser.CurrentLineNumber)

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.EntityDeclHandler = refuse_entity
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise NotRead(f"the file is not an XML: {expat.ErrorString(error.code)}", error.lineno) from None
    return top.children[0]
