"""Tables of benchmarks that stand in a page of the docs."""

import pathlib
import re
import sys


def put_into(file, name, text):
    """Replaces what stands between <!-- bench: NAME --> and the next <!-- bench: end --> of a page."""
    begin, end = f"<!-- bench: {name} -->", "<!-- bench: end -->"
    page = pathlib.Path(file).read_text()
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.S)
    if not pattern.search(page):
        sys.exit(f"{name}: {file}: has no {begin} ... {end}")
    pathlib.Path(file).write_text(pattern.sub(lambda _: f"{begin}\n{text}\n{end}", page))
