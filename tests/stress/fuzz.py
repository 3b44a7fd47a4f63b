"""Coverage-guided fuzzing of one reader: `python tests/stress/fuzz.py scene_toml -runs=100000`.

libFuzzer (through atheris: `pip install atheris`) breeds inputs that reach new lines of the
readers, from a valid one and from the nasty words of `test_hostile_input`. An input that is
answered with neither a result nor one clear line, takes longer than 10 s or more than 1 GiB of
memory ends the run with an error and is written to the working directory; options after the
reader's name are libFuzzer's.
"""

import sys
import tempfile
from pathlib import Path

import atheris

sys.path.insert(0, str(Path(__file__).parent))
# What is compiled (ebm, cm) must not be instrumented.
with atheris.instrument_imports(
    include=["rockcheck", "tomllib", "json", "csv"], exclude=["rockcheck.scenes.compiled"]
):
    from nasty import NASTY, WORDS
    from test_hostile_input import READERS


def quoted(word: str) -> str:
    return (
        '"'
        + "".join(f"\\x{byte:02x}" for byte in word.encode("utf-8", "surrogatepass")[:64])
        + '"\n'
    )


def main(reader: str, *options: str) -> None:
    """Feeds a reader until libFuzzer has enough; it ends the process."""
    feed, valid = READERS[reader]
    with tempfile.TemporaryDirectory() as place:
        corpus, folder, words = Path(place, "corpus"), Path(place, "folder"), Path(place, "words")
        corpus.mkdir()
        folder.mkdir()
        (corpus / "valid").write_text(valid(), encoding="utf-8")
        words.write_text("".join(map(quoted, filter(None, (*NASTY, *WORDS)))), encoding="ascii")
        feed(valid().encode(), folder)  # what it imports and compiles takes no part
        arguments = [
            "fuzz.py",
            f"-dict={words}",
            "-timeout=10",
            "-rss_limit_mb=1024",
            "-max_len=20000",
            *options,
            str(corpus),
        ]

        def fed(content: bytes) -> None:
            try:
                feed(content, folder)
            except BaseException:
                Path(f"failed-{reader}").write_bytes(content)
                raise

        atheris.Setup(arguments, fed)
        atheris.Fuzz()


if __name__ == "__main__":
    main(*sys.argv[1:])
