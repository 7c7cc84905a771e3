# SPDX-License-Identifier: Apache-2.0
"""A program with a session on a device, to be killed: python_owner.py SCENE CONFIG [--fork]"""

import gc
import os
import sys
import threading
import time

import haptic

scene = haptic.Scene.load(sys.argv[1])
session = haptic.Session(scene, device=sys.argv[2])
if "--fork" in sys.argv and os.fork() == 0:
    try:
        session.state()
        print("child: has a session", flush=True)
    except haptic.HapticError as error:
        print("child: has no session" if error.name == "HAPTIC_ERROR_CLOSED" else error, flush=True)
    del session
    gc.collect()
    time.sleep(20)
    os._exit(0)
print("open", flush=True)


def read() -> None:
    while True:
        session.state()
        session.device()
        time.sleep(0.001)


threading.Thread(target=read, daemon=True).start()
end = time.monotonic() + 60
while time.monotonic() < end:
    garbage = [[k] for k in range(10000)]
    gc.collect()
