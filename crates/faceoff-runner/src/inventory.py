# Prints the version and the packages of this Python as one line of JSON. Packages that agents often use are imported, since files of theirs may
# be missing or out of an agent's sight.
import importlib.metadata, json, os, platform, subprocess, sys, time
MODULES = {
    "gymnasium": "gymnasium", "h5py": "h5py", "jax": "jax", "numba": "numba", "numpy": "numpy", "onnxruntime": "onnxruntime",
    "pandas": "pandas", "scikit-learn": "sklearn", "scipy": "scipy.linalg", "tensorflow": "tensorflow", "torch": "torch",
}
# Packages for which no time is left count as they are installed.
END = time.monotonic() + 40
packages, unusable = {}, {}
for found in importlib.metadata.distributions():
    if found.name:
        packages.setdefault(found.name.lower(), found.version)
for name in sorted(packages.keys() & MODULES.keys()):
    # A process each: some end it when they fail, and together they may need more memory than an agent has.
    try:
        done = subprocess.run([sys.executable, "-c", f"import {MODULES[name]}"], capture_output=True, text=True, timeout=max(0, END - time.monotonic()))
    except subprocess.TimeoutExpired:
        continue
    if done.returncode:
        del packages[name]
        reason = done.stderr.strip().splitlines() or [f"the interpreter ended with status {done.returncode}"]
        unusable[name] = reason[-1][:300]
try:
    libc = (os.confstr("CS_GNU_LIBC_VERSION") or "").partition(" ")[2] or None
except ValueError:
    libc = None
print(json.dumps({
    "implementation": platform.python_implementation(),
    "version": platform.python_version(),
    "libc": libc,
    "packages": packages,
    "unusable_packages": unusable,
}))
