"""Runs a command, and prints what it used as JSON: a program of its own, `python launch.py WORDS`.

Linux counts the memory of the process that starts a program as the program's. This one is small.
"""

import json
import os
import subprocess
import sys
import time


def main(*words: str) -> int:
    """Run the command, print its times (s) and memory (units of `ru_maxrss`); its exit code."""
    began = time.perf_counter()
    process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - began
    print(json.dumps({"wall": wall, "cpu": used.ru_utime + used.ru_stime, "peak": used.ru_maxrss}))
    return os.waitstatus_to_exitcode(status)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
