"""The sections of a program: what its bytes are."""

import struct
from dataclasses import dataclass
from pathlib import Path

from runs import Failed

NO_BYTES = 8  # SHT_NOBITS: in memory only


@dataclass(frozen=True)
class Section:
    name: str
    bytes: int


def sections(program: Path) -> list[Section]:
    """The sections that take space in the file, the largest first. ELF of 64 bits, little-endian."""
    data = program.read_bytes()
    if data[:6] != b"\x7fELF\x02\x01":
        raise Failed(f"{program} is no ELF program of 64 bits, little-endian: its sections cannot be read here")
    (table,) = struct.unpack_from("<Q", data, 0x28)
    size, count, of_names = struct.unpack_from("<HHH", data, 0x3A)
    # name, type, flags, address, offset, size
    headers = [struct.unpack_from("<IIQQQQ", data, table + k * size) for k in range(count)]
    names_at = headers[of_names][4] if headers else 0
    found = []
    for name, kind, _, _, _, bytes_ in headers:
        start = names_at + name
        text = data[start : data.index(b"\0", start)].decode()
        if text and kind != NO_BYTES:
            found.append(Section(text, bytes_))
    return sorted(found, key=lambda section: -section.bytes)


def for_debuggers(found: list[Section]) -> list[str]:
    """What a stripped program does not have."""
    return sorted(section.name for section in found if section.name.startswith((".symtab", ".debug_", ".zdebug_")))
