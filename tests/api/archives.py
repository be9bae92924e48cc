"""Strategies of hypothesis (generators of random test data) for request bodies: valid archives, archives with invalid content, and
other bytes."""

import gzip
import io
import tarfile
import zipfile

from hypothesis import strategies as st

MANIFEST = b'name = "generated"\ncommand = ["python3", "agent.py"]\nruntime = "python3"\n'


def make_tar(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as archive:
        for name, content in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    return gzip.compress(buffer.getvalue(), mtime=0)


def make_zip(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content)
    return buffer.getvalue()


names = st.sampled_from(["agent.toml", "agent.py", "data/weights.bin", "../outside", "/etc/passwd", "a" * 90])
files = st.dictionaries(names, st.binary(max_size=64), max_size=4)
with_manifest = files.map(lambda contents: {**contents, "agent.toml": MANIFEST})


def truncate(archive: bytes, number: int) -> bytes:
    """The beginning of an archive, of a length that follows from any number."""
    return archive[: number % (len(archive) + 1)]


whole = st.one_of(files, with_manifest).flatmap(lambda contents: st.sampled_from([make_tar(contents), make_zip(contents)]))
archives = st.one_of(whole, st.builds(truncate, whole, st.integers(0, 4096)), st.binary(max_size=64))
