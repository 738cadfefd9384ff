"""Installs the other renderers into a folder of their own; `Peers` returns their commands and environments.

PyPI's mitsuba, numpy, OpenEXR and scipy go into a virtual environment, and bpy (Blender, for Cycles) into another one
on its first use. Debian's povray and libllvm19 are unpacked beside them. The system is not changed.
"""
import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
FOLDER = ROOT / "target" / "peers"
PYPI = ["mitsuba==3.9.1", "numpy", "OpenEXR", "scipy"]
CYCLES = ["bpy==5.0.1"]  # the last one for Python 3.11
DEBIAN = ["povray", "libllvm19"]


class Peers:
    def __init__(self, folder=FOLDER):
        self.folder = pathlib.Path(folder).resolve()
        self.python = self.folder / "venv" / "bin" / "python"
        self.debian = self.folder / "debian"
        self.libraries = self.debian / "usr" / "lib" / (sysconfig.get_config_var("MULTIARCH") or "x86_64-linux-gnu")

    def environment(self, name, packages):
        """Returns the Python of a virtual environment with these packages; installs them if necessary."""
        folder = self.folder / name
        python, stamp = folder / "bin" / "python", folder / "installed"
        if not stamp.exists() or stamp.read_text().split() != packages:
            print("installing " + ", ".join(packages) + f" into {os.path.relpath(folder)}", file=sys.stderr)
            subprocess.run([sys.executable, "-m", "venv", folder], check=True)
            subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *packages], check=True)
            stamp.write_text("\n".join(packages))
        return str(python)

    def cycles(self):
        return self.environment("cycles", CYCLES)

    def install(self):
        self.environment("venv", PYPI)
        subprocess.run([HERE / "debs", self.debian, "bookworm", *DEBIAN], check=True)
        for file in (self.povray()[0], self.llvm()):
            if not file or not pathlib.Path(file).exists():
                sys.exit(f"{file} is missing after the installation")

    def mesa_backports(self):
        """Returns the environment variables that select the lavapipe of Debian's backports."""
        line = subprocess.run([HERE / "mesa-backports", self.folder / "mesa-25"], check=True, stdout=subprocess.PIPE, text=True)
        return dict(pair.split("=", 1) for pair in line.stdout.split())

    def povray(self):
        """Returns the command and environment of the unpacked POV-Ray, or of the system's if it was already installed."""
        unpacked = self.debian / "usr" / "bin" / "povray"
        if not unpacked.exists():
            return shutil.which("povray"), {}
        paths = [str(self.libraries), str(self.libraries / "pulseaudio"), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
        return str(unpacked), {"LD_LIBRARY_PATH": ":".join(paths)}

    def llvm(self):
        """Returns the path of LLVM 19 for Mitsuba, whose code generation fails with LLVM 14 and 15 on machines with AVX-512."""
        system = pathlib.Path("/usr/lib") / self.libraries.name / "libLLVM.so.19.1"
        return next((str(p) for p in (self.libraries / "libLLVM.so.19.1", system) if p.exists()), None)

    def mitsuba(self):
        return str(self.python), {"DRJIT_LIBLLVM_PATH": self.llvm() or ""}
