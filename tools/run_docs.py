#!/usr/bin/env python3
"""Runs the code blocks of README.md and docs/*.md as a reader would.

usage: run_docs.py BUILD_FOLDER [--in FOLDER] [PAGE...]

Installs the build into a folder of its own ($POINTFLIGHT_INSTALLED: where it is already) and runs each
page's shell blocks there, line by line, with that program in the path. The README comes first; every other page starts
with the files that it left. With --in, README.md leaves them in FOLDER (made anew) and other pages find them there.
A comment on the line before a block says what else it is:

  <!-- docs: file NAME -->          the block is a file of that name, which later blocks use;
                                    `file NAME then COMMAND` runs a command on it
  <!-- docs: with A=B ... -->       run, with B under the name A: what a user has of his own
  <!-- docs: arguments REASON -->   not run; commands, flags and launch files in it must exist
  <!-- docs: text -->               a drawing, a formula, what a program prints
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml
from pathlib import Path

SOURCE = Path(__file__).resolve().parent.parent
SHELL = ("", "sh", "bash", "console")


class Broken(Exception):
    pass


class Block:
    def __init__(self, page, line, language, marker, text):
        self.place = f"{page}:{line}"
        self.language = language
        words = marker.split()
        self.kind, self.words = (words[0], words[1:]) if words else ("run", [])
        self.text = text
        if self.kind not in ("run", "file", "with", "arguments", "text"):
            raise Broken(f"{self.place}: 'docs: {marker}' is no marker")
        if self.kind in ("run", "with", "arguments") and language not in SHELL:
            raise Broken(f"{self.place}: a block of {language} needs a marker (tools/run_docs.py)")


def blocks_of(page):
    """The fenced blocks of a page, with their markers."""
    found, marker, start = [], "", None
    for number, line in enumerate((SOURCE / page).read_text().splitlines(), 1):
        if start is None:
            if line.startswith("```"):
                start, language, text = number, line[3:].strip(), []
                continue
            comment = re.fullmatch(r"<!-- docs: (.*) -->", line)
            if comment:
                marker = comment.group(1)
            elif line.strip():
                marker = ""
        elif line.startswith("```"):
            found.append(Block(page, start, language, marker, text))
            start, marker = None, ""
        else:
            text.append(line)
    return found


def commands_of(block):
    """Its lines, those that end in \\ joined, without ./dev's verbs, comments and empty ones."""
    lines, whole, ends_at = [], "", None
    for line in block.text:
        if ends_at:  # within a here-document
            lines.append(line)
            ends_at = None if line == ends_at else ends_at
            continue
        here = re.search(r"<<'?(\w+)'?", line)
        ends_at = here.group(1) if here else None
        whole += line
        if whole.endswith("\\"):
            whole = whole[:-1]
            continue
        command = re.sub(r"(^|\s)#\s.*$", "", whole).strip()
        whole = ""
        if command and not command.startswith("./dev"):
            lines.append(command)
    return lines


class Tree:
    """Which commands and flags there are, as the program's own completion script says."""

    def __init__(self, environment):
        script = subprocess.run(["pointflight", "completion"], env=environment, capture_output=True,
                                text=True, check=True).stdout
        self.words = {path: words.split()
                      for path, words in re.findall(r"^    '(.*)'\) words='(.*)' ;;$", script, re.M)}

    def check(self, place, command):
        path = ""
        for word in command.split()[1:]:
            longer = f"{path} {word}".strip()
            if longer in self.words:
                path = longer
            elif word.startswith("-"):
                if word.split("=")[0] not in self.words[path]:
                    raise Broken(f"{place}: 'pointflight {path}' has no flag {word}")


def check_launch(place, command):
    """A launch file of ours, and arguments that it declares."""
    words = command.split()
    name = next(word for word in words if ".launch" in word)
    files = list((SOURCE / "ros_packages").rglob(name))
    if not files:
        raise Broken(f"{place}: there is no {name}")
    text = files[0].read_text()
    if name.endswith(".py"):
        declared = set(re.findall(r"DeclareLaunchArgument\(\s*['\"](\w+)", text))
        declared |= set(re.findall(r"^\s*['\"](\w+)['\"]:", text, re.M))
    else:
        declared = {arg.get("name") for arg in xml.fromstring(text).iter("arg")}
    for word in words:
        argument = word.split(":=")[0] if ":=" in word else None
        if argument and argument not in declared:
            raise Broken(f"{place}: {name} has no argument '{argument}'")


def check_arguments(block, tree):
    for command in commands_of(block):
        for part in re.split(r"\||&&", command):
            part = part.strip()
            if part.startswith("pointflight "):
                tree.check(block.place, part)
            elif re.match(r"roslaunch|ros2 launch", part):
                check_launch(block.place, part)


def lay_out(block, folder):
    """Puts files of the user's own there, under the names that the page gives them."""
    for word in block.words:
        name, source = word.split("=")
        target, source = folder / name, folder / source
        if not source.exists():
            raise Broken(f"{block.place}: {source.name} is not there to stand for {name}")
        if not target.exists():
            (shutil.copytree if source.is_dir() else shutil.copy)(source, target)


def run(block, folder, environment):
    if block.kind == "with":
        lay_out(block, folder)
    script = "\n".join(commands_of(block))
    if script:
        execute(script, block, folder, environment)


def execute(script, block, folder, environment):
    done = subprocess.run(["bash", "-eo", "pipefail", "-c", script], cwd=folder, env=environment,
                          capture_output=True, text=True, timeout=1500)  # a hang, not a slow machine
    if done.returncode != 0:
        raise Broken(f"{block.place}: exit code {done.returncode}\n{script}\n"
                     f"{done.stdout[-2000:]}{done.stderr[-2000:]}")


def run_page(page, folder, environment, tree):
    folder.mkdir(parents=True, exist_ok=True)
    counts = {}
    for block in blocks_of(page):
        counts[block.kind] = counts.get(block.kind, 0) + 1
        if block.kind == "file":
            path = folder / block.words[0]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("\n".join(block.text) + "\n")
            if block.words[1:2] == ["then"]:
                execute(" ".join(block.words[2:]), block, folder, environment)
        elif block.kind == "arguments":
            check_arguments(block, tree)
        elif block.kind != "text":
            run(block, folder, environment)
    if counts:
        print(f"{page}: " + ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items())),
              flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=Path)
    parser.add_argument("--in", type=Path, dest="shared")
    parser.add_argument("pages", nargs="*")
    options = parser.parse_intermixed_args()
    build = options.build.resolve()
    pages = options.pages or [str(page.relative_to(SOURCE)) for page in sorted((SOURCE / "docs").glob("*.md"))]
    with tempfile.TemporaryDirectory(prefix="pointflight_docs_") as scratch:
        shared = options.shared.resolve() if options.shared else Path(scratch)
        begins = options.shared is None or pages == ["README.md"]
        prefix = Path(os.environ.get("POINTFLIGHT_INSTALLED", shared / "usr"))
        if begins:
            shutil.rmtree(shared / "README", ignore_errors=True)
            if "POINTFLIGHT_INSTALLED" not in os.environ:
                shutil.rmtree(prefix, ignore_errors=True)
                subprocess.run(["cmake", "--install", build, "--prefix", prefix], check=True, capture_output=True)
        environment = dict(os.environ, PATH=f"{prefix}/bin:{os.environ['PATH']}",
                           CMAKE_PREFIX_PATH=str(prefix), POINTFLIGHT_PREFIX=str(prefix),
                           SOURCE=str(SOURCE), CLICOLOR="0")
        environment.pop("POINTFLIGHT_DATA", None)
        tree = Tree(environment)
        first = shared / "README"
        if begins:
            run_page("README.md", first, environment, tree)
        for number, page in enumerate(page for page in pages if page != "README.md"):
            folder = Path(scratch) / f"page{number}"
            if any(block.kind in ("run", "with", "file") for block in blocks_of(page)):
                subprocess.run(["cp", "-a", first, folder], check=True)
            run_page(page, folder, environment, tree)


if __name__ == "__main__":
    try:
        main()
    except Broken as error:
        sys.exit(f"run_docs: {error}")
