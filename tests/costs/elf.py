"""The sections of a program and their sizes."""

import struct
from dataclasses import dataclass
from pathlib import Path

from runs import Failed

# The type of a section that takes no bytes of the file, only memory.
SHT_NOBITS = 8


@dataclass(frozen=True)
class Section:
    name: str
    bytes: int


def sections(program: Path) -> list[Section]:
    """The sections with content in the file, the largest first. For 64-bit little-endian ELF."""
    data = program.read_bytes()
    if data[:6] != b"\x7fELF\x02\x01":
        raise Failed(f"{program} is no ELF program of 64 bits, little-endian: its sections cannot be read")
    # Offsets in the file's header: the table of section headers; their size and number, and the index of the one with their names.
    (table,) = struct.unpack_from("<Q", data, 0x28)
    size, count, name_index = struct.unpack_from("<HHH", data, 0x3A)
    # name, type, flags, address, offset, size
    headers = [struct.unpack_from("<IIQQQQ", data, table + k * size) for k in range(count)]
    names_offset = headers[name_index][4] if headers else 0
    found = []
    for name, kind, _, _, _, bytes_ in headers:
        start = names_offset + name
        text = data[start : data.index(b"\0", start)].decode()
        if text and kind != SHT_NOBITS:
            found.append(Section(text, bytes_))
    return sorted(found, key=lambda section: -section.bytes)


def debug_sections(found: list[Section]) -> list[str]:
    """The names of sections that a stripped program does not have."""
    return sorted(section.name for section in found if section.name.startswith((".symtab", ".debug_", ".zdebug_")))
