# Prints the version and the packages of this Python as one line of JSON.
import importlib.metadata, json, os, platform
packages = {}
for found in importlib.metadata.distributions():
    if found.name:
        packages.setdefault(found.name.lower(), found.version)
try:
    libc = (os.confstr("CS_GNU_LIBC_VERSION") or "").partition(" ")[2] or None
except ValueError:
    libc = None
print(json.dumps({
    "implementation": platform.python_implementation(),
    "version": platform.python_version(),
    "libc": libc,
    "packages": packages,
}))
