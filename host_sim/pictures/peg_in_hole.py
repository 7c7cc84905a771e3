#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws one tick of a replay: the part where it is felt, the goal that the hand asks for, contacts, force and torque.

    host_sim replay SCENE.rtscene --motion M.csv --out R.csv --contacts C.csv
    peg_in_hole.py host_sim/scenes/square_peg_five M.csv R.csv C.csv --tick 11000 -o peg_in_hole.svg

The wall of the block in front of the part is cut away. Law proxy: the felt pose follows from the wrench,
x = x_goal + F / k_t, and in rotation by tau / k_r.
"""
import argparse
import csv
import math
import tomllib
from pathlib import Path

PIXELS_PER_M = 5600.0
TURN, RISE = math.radians(-17), math.radians(22)  # of the viewer: about z, above the horizon
LIGHT = (-0.35, -0.75, 0.55)
DEFAULT_LENGTH_RADII = 1.5  # L of the coupling over the radius of the part, without a [device]
PIXELS_PER_NEWTON = 75.0


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def scaled(a, s):
    return tuple(x * s for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def matrix_of(w, x, y, z):
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))


def turned(m, v):
    return tuple(dot(row, v) for row in m)


def rotation_by(v):
    angle = math.sqrt(dot(v, v))
    s = math.sin(angle / 2) / angle if angle > 0 else 0.5
    return matrix_of(math.cos(angle / 2), *scaled(v, s))


def product(a, b):
    columns = list(zip(*b))
    return tuple(tuple(dot(row, c) for c in columns) for row in a)


def read_mesh(path, scale):
    """Vertices in m and faces of an OFF or OBJ file."""
    lines = [l.split("#")[0].split() for l in path.read_text().splitlines()]
    lines = [l for l in lines if l]
    if path.suffix == ".obj":
        points = [tuple(float(x) * scale for x in l[1:4]) for l in lines if l[0] == "v"]
        return points, [[int(i.split("/")[0]) - 1 for i in l[1:]] for l in lines if l[0] == "f"]
    count, faces = int(lines[1][0]), int(lines[1][1])
    points = [tuple(float(x) * scale for x in l[:3]) for l in lines[2:2 + count]]
    return points, [[int(i) for i in l[1:]] for l in lines[2 + count:2 + count + faces]]


def row_of(path, tick):
    with open(path, newline="") as file:
        for k, row in enumerate(csv.DictReader(file)):
            if int(row.get("tick", k)) == tick:
                return row
    raise SystemExit(f"peg_in_hole: {path}: no tick {tick}")


def contacts_at(path, tick):
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            if int(row["tick"]) == tick:
                yield [tuple(float(x) for x in p.split()) for p in row["polygon_m"].split(";")]


def clipped(polygon, y):
    """The part of a polygon behind y."""
    out = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1]):
        if a[1] >= y:
            out.append(a)
        if (a[1] < y) != (b[1] < y):
            t = (y - a[1]) / (b[1] - a[1])
            out.append(add(a, scaled(add(b, scaled(a, -1)), t)))
    return out


class Picture:
    def __init__(self, width, height, origin):
        self.size, self.origin, self.items = (width, height), origin, []
        ct, st, cr, sr = math.cos(TURN), math.sin(TURN), math.cos(RISE), math.sin(RISE)
        self.right = (ct, st, 0.0)
        self.up = (-st * sr, ct * sr, cr)
        self.back = (-st * cr, ct * cr, -sr)  # away from the viewer

    def at(self, p):
        return (self.origin[0] + PIXELS_PER_M * dot(self.right, p),
                self.origin[1] - PIXELS_PER_M * dot(self.up, p))

    def path(self, points, style, closed=True):
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(self.at, points))
        self.items.append(f'<{"polygon" if closed else "polyline"} points="{text}" {style}/>')

    def shaded(self, points, colour, edge):
        n = cross(add(points[1], scaled(points[0], -1)), add(points[2], scaled(points[1], -1)))
        share = 0.62 + 0.38 * max(0.0, dot(n, LIGHT) / math.sqrt(dot(n, n) * dot(LIGHT, LIGHT)))
        fill = "#" + "".join(f"{round(c * share):02x}" for c in colour)
        self.path(points, f'fill="{fill}" stroke="{edge}" stroke-width="1" stroke-linejoin="round"')

    def solid(self, points, faces, colour, edge):
        for face in sorted((f for f in faces if self.faces_us(points, f)),
                           key=lambda f: -sum(dot(points[i], self.back) for i in f) / len(f)):
            self.shaded([points[i] for i in face], colour, edge)

    def faces_us(self, points, face):
        a, b, c = (points[i] for i in face[:3])
        return dot(cross(add(b, scaled(a, -1)), add(c, scaled(b, -1))), self.back) < 0

    def line(self, a, b, style):
        self.items.append(f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" {style}/>')

    def text(self, x, y, words, style=""):
        self.items.append(f'<text x="{x:.0f}" y="{y:.0f}" {style}>{words}</text>')

    def arrow(self, start, end, colour):
        dx, dy = end[0] - start[0], end[1] - start[1]
        far = math.hypot(dx, dy)
        ux, uy = dx / far, dy / far
        neck = (end[0] - 16 * ux, end[1] - 16 * uy)
        self.line(start, neck, f'stroke="{colour}" stroke-width="5" stroke-linecap="round"')
        tip = [end, (neck[0] - 8 * uy, neck[1] + 8 * ux), (neck[0] + 8 * uy, neck[1] - 8 * ux)]
        self.items.append(f'<polygon points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in tip)}" fill="{colour}"/>')

    def write(self, path):
        w, h = self.size
        path.write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w} {h}" width="{w}" height="{h}" '
            'font-family="sans-serif" font-size="15" fill="#222">\n'
            "<!-- SPDX-License-Identifier: Apache-2.0; drawn by host_sim/pictures/peg_in_hole.py -->\n"
            f'<rect width="{w}" height="{h}" rx="8" fill="#fdfdfb"/>\n' + "\n".join(self.items) + "\n</svg>\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("scene", "motion", "replay", "contacts"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--tick", type=int, required=True)
    parser.add_argument("-o", "--out", type=Path, required=True)
    given = parser.parse_args()
    scene = tomllib.loads((given.scene / "scene.toml").read_text())
    moving, block = scene["moving"], scene["static"][0]
    part, faces = read_mesh(given.scene / moving["mesh"], moving["scale_to_m"])
    wall, wall_faces = read_mesh(given.scene / block["mesh"], block["scale_to_m"])
    grip = tuple(moving["grip_m"])
    k_t = scene["rendering"]["k_f_n_per_m"]
    length = DEFAULT_LENGTH_RADII * max(math.dist(grip, v) for v in part)

    motion, tick = row_of(given.motion, given.tick), row_of(given.replay, given.tick)
    goal_r = matrix_of(*(float(motion[k]) for k in ("qw", "qx", "qy", "qz")))
    goal_x = tuple(float(motion[k]) for k in "xyz")
    force = tuple(float(tick[f"f{a}_n"]) for a in "xyz")
    torque = tuple(float(tick[f"t{a}_nm"]) for a in "xyz")
    goal_grip = add(goal_x, turned(goal_r, grip))
    felt_grip = add(goal_grip, scaled(force, 1 / k_t))
    felt_r = product(rotation_by(scaled(torque, 1 / (k_t * length * length))), goal_r)

    def placed(r, at):
        return [add(at, turned(r, add(v, scaled(grip, -1)))) for v in part]

    felt, goal = placed(felt_r, felt_grip), placed(goal_r, goal_grip)
    picture = Picture(920, 520, (322, 196))
    x0, x1 = min(v[0] for v in wall), max(v[0] for v in wall)
    z0, z1 = min(v[2] for v in wall), max(v[2] for v in wall)
    inner = [v for v in wall if abs(v[0]) < 0.9 * x1]
    h, floor = max(v[0] for v in inner), min(v[2] for v in inner)
    front = -h  # the wall before the part is cut away
    # The block behind the cut: faces that look at us, farthest first, then the cut itself.
    shown = []
    for f in wall_faces:
        half = clipped([wall[i] for i in f], front)
        if len(half) > 2 and picture.faces_us(half, range(len(half))):
            shown.append(half)
    for half in sorted(shown, key=lambda h: -sum(dot(p, picture.back) for p in h) / len(h)):
        picture.shaded(half, (196, 205, 214), "#8593a1")
    corners = [(x0, z0), (x1, z0), (x1, z1), (h, z1), (h, floor), (-h, floor), (-h, z1), (x0, z1)]
    picture.solid(felt, faces, (240, 186, 104), "#a06a1b")
    picture.path([(x, front, z) for x, z in corners], 'fill="#dfe5ea" stroke="#8593a1" stroke-width="1" stroke-linejoin="round"')
    # The goal pose: outline of the faces that look at us.
    for f in faces:
        if picture.faces_us(goal, f):
            picture.path([goal[i] for i in f],
                         'fill="none" stroke="#3367a8" stroke-width="1.6" stroke-dasharray="6 4"')
    contacts = list(contacts_at(given.contacts, given.tick))
    for polygon in contacts:
        if len(polygon) > 1:
            picture.path(polygon, 'fill="#c2185b" fill-opacity="0.3" stroke="#c2185b" stroke-width="3.5"', len(polygon) > 2)
        for p in polygon:
            x, y = picture.at(p)
            picture.items.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="#c2185b"/>')
    start = picture.at(felt_grip)
    share = PIXELS_PER_NEWTON / PIXELS_PER_M
    end = picture.at(add(felt_grip, scaled(force, share)))
    picture.items.append(f'<circle cx="{start[0]:.1f}" cy="{start[1]:.1f}" r="5" fill="#1b7f3b"/>')
    picture.arrow(start, end, "#1b7f3b")
    newton = math.sqrt(dot(force, force))
    picture.text(end[0] - 8, end[1] - 22, f"force on the hand {newton:.2f} N", 'text-anchor="end" fill="#1b7f3b" font-weight="bold"')
    picture.text(end[0] - 8, end[1] - 2, f"torque {math.sqrt(dot(torque, torque)):.3f} N m",
                 'text-anchor="end" fill="#1b7f3b"')
    far = math.dist(goal_grip, felt_grip)
    notes = [("#a06a1b", "the part where it is felt:", "always outside the block"),
             ("#3367a8", "the pose that the hand asks for:", f"{1e3 * far:.1f} mm away"),
             ("#c2185b", "the contacts that hold the part:", f"{len(contacts)} regions, drawn through the part"),
             ("#1b7f3b", "the pull of the spring", "between the two, at the grip point")]
    for k, (colour, first, second) in enumerate(notes):
        y = 130 + 66 * k
        picture.items.append(f'<rect x="560" y="{y - 13}" width="12" height="32" fill="{colour}"/>')
        picture.text(582, y, first)
        picture.text(582, y + 20, second, 'fill="#555"')
    picture.text(24, 508, f"{scene['name']}, t = {float(tick['t_s']):.2f} s; the front wall of the block is cut away",
                 'font-size="13" fill="#555"')
    picture.write(given.out)


if __name__ == "__main__":
    main()
