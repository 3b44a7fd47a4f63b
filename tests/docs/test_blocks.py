"""Every code block of the README and of docs/ is run, in order, each page in a folder of its own.

- python: executed; the blocks of a page share their names, as in a notebook.
- a block with `title="file"`: written to that file, and loaded as what it is; a script is run.
- bash, and indented commands: run; one that fails, fails the page. `make` targets are looked up
  instead of run.
- text: a session is run where it begins with `$ `: what is seen at 80 columns has these words, any
  number for a number; `...` stands for more.

Pages of studies hold commands of many minutes; these are run with `@pytest.mark.slow`, the longest
in their `--quick` form.
"""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections import namedtuple
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
LANGUAGES = {"python", "bash", "toml", "csv", "yaml", "text"}
#: Pages whose commands take half a minute and more: every night.
LATE = ("ci", "conformance", "running", "storeys")
#: Commands that take minutes, and the form of them that takes less, where there is one.
LONG = {"benchmark": "--quick", "spectrum": "", "validate": "", "stress": "--quick"}


#: A code block: its language, the file that it shows, its text, and the line of its page.
Block = namedtuple("Block", ("language", "file", "text", "line"))


def blocks_of(page: Path) -> Iterator[Block]:
    """The fenced and indented blocks of a page; an indented one is a shell's."""
    for token in MarkdownIt().parse(page.read_text("utf-8")):
        line = token.map[0] + 2 if token.map else 0
        if token.type == "fence":
            language, _, rest = token.info.strip().partition(" ")
            title = re.fullmatch(r'title="([^"]+)"', rest)
            assert bool(title) == bool(rest), f"{page.name}, line {line}: {token.info}"
            assert language in LANGUAGES, f"{page.name}, line {line}: {language!r}"
            assert title or language in ("python", "bash", "text"), (
                f"{page.name}, line {line}: a file without a name is not run"
            )
            yield Block(language, title[1] if title else "", token.content, line)
        elif token.type == "code_block":
            yield Block("bash", "", token.content, line)


def commands_of(text: str) -> list[str]:
    lines = (line.split(" #")[0].rstrip() for line in text.splitlines())
    return [line for line in lines if line and not line.startswith("#")]


def is_long(command: str) -> bool:
    """Whether a command takes minutes: a study, or a named suite; a page's own suites and scenes
    are short."""
    _, name, *words = [*shlex.split(command), ""]
    return (
        command.startswith("rockcheck ")
        and name in LONG
        and not any(word.endswith(".toml") for word in words)
    )


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env={
            **os.environ,
            "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        },
        capture_output=True,
        text=True,
        check=False,
    )


def run_shell(command: str, folder: Path) -> None:
    """Run one command that has to succeed; of `make` only whether the target is there."""
    made = command.startswith("make ")
    done = shell(command.replace("make", "make -n", 1), ROOT) if made else shell(command, folder)
    assert done.returncode == 0, f"{command}: exit {done.returncode}: {done.stderr or done.stdout}"


def run_session(text: str, folder: Path) -> None:
    """Run `$ command`, and compare what is seen with what the page shows."""
    command, _, shown = text.removeprefix("$ ").partition("\n")
    done = shell(f"COLUMNS=80 {command}", folder)
    seen, said = (re.sub(r"\d+(\.\d+)*", "#", words) for words in (done.stdout, shown))
    parts = [re.escape(" ".join(part.split())) for part in said.split("...")]
    assert re.fullmatch(" ?.*? ?".join(parts), " ".join(seen.split())), done.stdout + done.stderr


def show_file(block: Block, folder: Path) -> None:
    path = folder / block.file
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(block.text, "utf-8")
    if block.language == "toml":
        tomllib.loads(block.text)
    elif block.language == "bash":
        run_shell(f"set -e; . ./{block.file}", folder)
    elif block.language == "yaml":
        jobs = yaml.safe_load(block.text)["jobs"]
        for step in (step.get("run", "") for job in jobs.values() for step in job["steps"]):
            if step.startswith("rockcheck"):
                run_shell(step, folder)


@pytest.mark.long
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=page.stem, marks=[pytest.mark.slow] * (page.stem in LATE))
        for page in PAGES
    ],
)
def test_blocks_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    for block in blocks_of(page):
        if block.file:
            show_file(block, tmp_path)
        elif block.language == "python":  # a traceback points into the page
            exec(compile("\n" * (block.line - 1) + block.text, str(page), "exec"), names)
        elif block.text.startswith("$ "):
            run_session(block.text, tmp_path)
        elif block.language == "bash":
            for command in commands_of(block.text):
                if not is_long(command):
                    run_shell(command, tmp_path)


LONG_COMMANDS = sorted(
    {
        command
        for page in PAGES
        for block in blocks_of(page)
        if block.language == "bash" and not block.file
        for command in commands_of(block.text)
        if is_long(command)
    }
)


@pytest.mark.parametrize("command", LONG_COMMANDS)
def test_long_commands_are_understood(command, tmp_path):
    """Their words are all known: with one more that is not, only that one is complained of."""
    done = shell(f"{command} --no-such-option", tmp_path)
    assert done.returncode == 2
    assert "--no-such-option" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    sorted(
        {
            command if (quick := LONG[command.split()[1]]) in command else f"{command} {quick}"
            for command in LONG_COMMANDS
        }
    ),
)
def test_long_commands_run(command, tmp_path):
    run_shell(command, tmp_path)
