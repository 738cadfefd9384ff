"""Runs a program and writes its time in seconds, its peak memory in bytes and its exit status to a file.

    python3 -I -S launch.py LIMIT FILE PROGRAM ARGUMENT...

On Linux the peak memory of a process starts from that of its parent, so this parent is a minimal interpreter (-I -S).
A program that is killed after LIMIT seconds has the status -9.
"""
import os
import signal
import sys
import time

limit, file, *command = sys.argv[1:]
start = time.perf_counter()
child = os.posix_spawnp(command[0], command, os.environ)
signal.signal(signal.SIGALRM, lambda *_: os.kill(child, signal.SIGKILL))
signal.setitimer(signal.ITIMER_REAL, float(limit))
_, status, usage = os.wait4(child, 0)
with open(file, "w") as out:
    print(time.perf_counter() - start, usage.ru_maxrss * 1024, os.waitstatus_to_exitcode(status), file=out)
