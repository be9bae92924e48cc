"""Archives as bodies: good ones, ones with rubbish in them, and what is none."""

import gzip
import io
import tarfile
import zipfile

from hypothesis import strategies as st

MANIFEST = b'name = "generated"\ncommand = ["python3", "agent.py"]\nruntime = "python3"\n'


def tarred(files: dict[str, bytes]) -> bytes:
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w") as archive:
        for name, content in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    return gzip.compress(made.getvalue(), mtime=0)


def zipped(files: dict[str, bytes]) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content)
    return made.getvalue()


names = st.sampled_from(["agent.toml", "agent.py", "data/weights.bin", "../outside", "/etc/passwd", "a" * 90])
files = st.dictionaries(names, st.binary(max_size=64), max_size=4)
with_manifest = files.map(lambda some: {**some, "agent.toml": MANIFEST})


def cut(archive: bytes, at: int) -> bytes:
    """An archive that ends too early."""
    return archive[: at % (len(archive) + 1)]


whole = st.one_of(files, with_manifest).flatmap(lambda some: st.sampled_from([tarred(some), zipped(some)]))
archives = st.one_of(whole, st.builds(cut, whole, st.integers(0, 4096)), st.binary(max_size=64))
