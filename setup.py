"""Builds the compiled part by CMake (python/CMakeLists.txt) and packs it with the package and data/."""

import os
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

SOURCE = os.path.dirname(os.path.abspath(__file__))


def version() -> str:
    """As CMakeLists.txt has it."""
    with open(os.path.join(SOURCE, "CMakeLists.txt"), encoding="utf-8") as file:
        found = re.search(r"project\(pointflight VERSION ([\d.]+)", file.read())
    assert found is not None
    return found[1]


class CMakeBuild(build_ext):
    """Puts the package, its compiled part and the data where setuptools packs them."""

    def run(self) -> None:
        build = os.path.join(SOURCE, "build", "wheel")
        configure = ["cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-D", "CMAKE_BUILD_TYPE=Release"]
        subprocess.run([*configure, "-D", f"POINTFLIGHT_PYTHON_EXECUTABLE={sys.executable}"], check=True)
        subprocess.run(["cmake", "--build", build, "--target", "pointflight_python"], check=True)
        package = os.path.join(self.build_lib, "pointflight")
        built = os.path.join(build, "python", "pointflight")
        shutil.copytree(built, package, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copytree(os.path.join(SOURCE, "data"), os.path.join(package, "data"), dirs_exist_ok=True)


setup(
    version=version(),
    packages=[],
    ext_modules=[Extension("pointflight._pointflight", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
)
