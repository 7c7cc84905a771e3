# SPDX-License-Identifier: Apache-2.0
"""Judges the stand-in for Haply's Inverse service by a client of another library (python3-websockets), written from
docs.haply.co (websocket-protocol, control-commands) and from how published clients use the service (IsaacLab's
se3_haply.py, BSD-3): the first message is the inventory, then there is one answer for each message; a force is exerted
under the key of the version and under no other.

    independent_client.py STAND_IN VERSION [--expect-force KEY]
"""
import asyncio
import json
import re
import subprocess
import sys
import urllib.request

import websockets


def check(holds, text):
    if not holds:
        sys.exit("independent_client: " + text)


def first_of(message, group):
    entries = message.get(group, [])
    return entries[0] if entries else {}


def request(device, key, force):
    return json.dumps({"inverse3": [{"device_id": device,
                                     "commands": {"set_cursor_force": {key: dict(zip("xyz", force))}}}]})


async def talk(port, version, key):
    other = {"values": "vector", "vector": "values"}[key]
    async with websockets.connect("ws://127.0.0.1:%d" % port, ping_interval=None) as service:
        inventory = json.loads(await asyncio.wait_for(service.recv(), 2))
        arm, grip = first_of(inventory, "inverse3"), first_of(inventory, "wireless_verse_grip")
        check(arm.get("config", {}).get("type") == "inverse3", "the inventory has no Inverse3 with its configuration")
        check("device_id" in grip, "the inventory has no wireless grip")
        device = arm["device_id"]
        heights, forces, pressed = [], [], set()
        for k in range(500):
            await service.send(request(device, key, (0.001 * k, 0.0, -0.5)))
            message = json.loads(await asyncio.wait_for(service.recv(), 2))
            arm, grip = first_of(message, "inverse3"), first_of(message, "wireless_verse_grip")
            check("config" not in arm, "an answer repeats the configuration")
            check(set("xyz") <= set(arm["state"]["cursor_position"]), "an answer has no cursor position")
            check(set("xyzw") <= set(grip["state"]["orientation"]), "an answer has no orientation")
            pressed.add(grip["state"]["buttons"]["a"])
            check(arm["status"]["in_use"] is True, "a force does not put the device in use")
            heights.append(arm["state"]["cursor_position"]["z"])
            if version == "3.5":
                forces.append(arm["state"]["current_cursor_force"])
            await asyncio.sleep(0.001)
        check(max(heights) > min(heights), "the handle does not move")
        check(True in pressed, "button a is never pressed")
        for k, force in enumerate(forces):
            check(abs(force["x"] - 0.001 * k) < 1e-9 and force["z"] == -0.5, "the force is not the one that was sent")
        try:
            await asyncio.wait_for(service.recv(), 0.05)
            check(False, "an answer came without a message")
        except asyncio.TimeoutError:
            pass
        await service.send(request(device, other, (1.0, 0.0, 0.0)))
        message = json.loads(await asyncio.wait_for(service.recv(), 2))
        check(first_of(message, "inverse3")["status"]["in_use"] is False, "the key of the other version exerts a force")
        await service.send(json.dumps({"session": {"force_render_full_state": {}}}))
        check("inverse3" in json.loads(await asyncio.wait_for(service.recv(), 2)), "a session command is not answered")


def main():
    stand_in, version = sys.argv[1], sys.argv[2]
    key = sys.argv[4] if len(sys.argv) > 4 else {"3.1": "values", "3.5": "vector"}[version]
    program = subprocess.Popen([stand_in, version, "0", "0", "20"], stdout=subprocess.PIPE, text=True)
    try:
        ports = [int(n) for n in re.findall(r"\d+", program.stdout.readline())]
        check(len(ports) == 2, "the stand-in does not listen")
        with urllib.request.urlopen("http://127.0.0.1:%d/version" % ports[0], timeout=2) as answer:
            check(json.load(answer)["project_version"].startswith(version + "."), "/version names another version")
        with urllib.request.urlopen("http://127.0.0.1:%d/devices" % ports[0], timeout=2) as answer:
            check(json.load(answer)["inverse3"][0]["device_id"] == "049D", "/devices does not list the device")
        asyncio.run(talk(ports[1], version, key))
    finally:
        program.terminate()
        program.wait()


main()
