#!/usr/bin/env python3
"""The same drives in wayhome and in MuJoCo: trajectories side by side.

    python3 -m venv .venv && .venv/bin/pip install mujoco==4.0.0
    .venv/bin/python tests/outside/mujoco_planar.py
    target/release/wayhome verify physics --out results/physics

writes results/physics/mujoco.csv; the report then shows it. Not part of CI: it needs MuJoCo, and the table only changes when
the physics does.

The robot is a Create 3 with equal wheels on a flat floor. wayhome drives it with `wayhome drive`. For MuJoCo it is a body with
all six degrees of freedom on two spheres that roll (wheels: point contacts, as in wayhome) and a sphere that slides (caster),
its centre of gravity at floor level, so that no load moves, as wayhome has it by default. Motors and speed loop are wayhome's
equations, written anew here; what is MuJoCo's own is the contact: an elliptic friction cone, solved by its Newton solver.
"""

import argparse
import csv
import math
import pathlib
import subprocess
import tempfile

import mujoco

ROBOT = dict(mass=2.3, radius=0.164, cog=0.03, track=0.233, wheel=0.036, wheel_inertia=1e-4, caster=0.125, caster_friction=0.05,
             stall=0.6, no_load=16.0, kp=0.4, ki=4.0, acceleration=0.9)
STEP = 2.5e-4   # of MuJoCo, s: a quarter of wayhome's
SAMPLE = 0.1    # s

CREEPS = [0.01, 0.0005]  # of wayhome, m/s: the default, and wheels that hardly creep

# name: (friction, rows of t, v, omega; the last row is the end)
DRIVES = {
    "straight (dry)": (0.75, [(0, 0.3, 0), (5, 0, 0), (6, 0, 0)]),
    "circle (dry)": (0.75, [(0, 0.25, 1.0), (7, 0, 0), (8, 0, 0)]),
    "slalom (dry)": (0.75, [(0, 0.28, 0.8), (2, 0.28, -0.8), (6, 0.28, 0.8), (8, 0, 0), (9, 0, 0)]),
    "turns on the spot (dry)": (0.75, [(0, 0, 1.9), (3, 0, -1.2), (6, 0.2, 0), (8, 0, 0), (9, 0, 0)]),
    "start and stop (ice)": (0.04, [(0, 0.3, 0), (3, 0, 0), (5, -0.3, 0), (7, 0, 0), (9, 0, 0)]),
    "curve (ice)": (0.04, [(0, 0.3, 0), (2, 0.3, 1.5), (5, 0.3, -1.5), (8, 0, 0), (10, 0, 0)]),
}


def wayhome(binary, friction, creep, rows, folder):
    """Rows of (t, x, y, heading) as `wayhome drive` writes them; creep in m/s."""
    world = folder / "world.toml"
    world.write_text(
        f"""name = "outside"
home = {{ x_m = 0.0, y_m = 0.0 }}
room = {{ outline_m = [[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]] }}
floor = {{ friction = {friction} }}
task = {{ control_period_s = {SAMPLE} }}
[robot]
wheel_radius_error = [0.0, 0.0]
rolling_resistance = 0.0
creep_m_s = {creep}
""")
    table = folder / "commands.csv"
    table.write_text("t_s,v_m_s,omega_rad_s\n" + "".join(f"{t},{v},{w}\n" for t, v, w in rows))
    out = folder / "out"
    subprocess.run([binary, "drive", world, "--commands", table, "--out", out, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    with open(out / "drive.csv", newline="") as file:
        return [tuple(float(row[c]) for c in ("t_s", "x_m", "y_m", "heading_rad")) for row in csv.DictReader(file)]


def model(friction):
    r = ROBOT
    inertia = 0.5 * r["mass"] * r["radius"] ** 2
    # The part of the torque that falls with speed is damping, which the integrator takes implicitly.
    damping = r["stall"] * (r["kp"] + 1 / r["no_load"])
    wheel = "".join(
        f"""
        <body name="{side}" pos="0 {sign * r["track"] / 2} 0">
          <inertial pos="0 0 0" mass="1e-5" diaginertia="1e-9 1e-9 1e-9"/>
          <joint name="{side}" type="hinge" axis="0 1 0" armature="{r["wheel_inertia"]}" damping="{damping}"/>
          <geom name="{side}" type="sphere" size="{r["wheel"]}"/>
        </body>""" for side, sign in (("left", 1), ("right", -1)))
    pair = lambda geom, mu: f'<pair geom1="floor" geom2="{geom}" condim="3" friction="{mu} {mu} 0 0 0" solref="0.002 1" solimp="0.99 0.999 1e-4"/>'
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option timestep="{STEP}" integrator="implicitfast" cone="elliptic" impratio="100" solver="Newton" tolerance="1e-12"
          iterations="100" gravity="0 0 -9.81"/>
  <worldbody>
    <geom name="floor" type="plane" size="20 20 1"/>
    <body name="base" pos="0 0 {r["wheel"]}">
      <freejoint/>
      <inertial pos="{r["cog"]} 0 {-r["wheel"]}" mass="{r["mass"]}" diaginertia="{0.6 * inertia} {0.6 * inertia} {inertia}"/>
      <geom name="caster" type="sphere" size="0.01" pos="{r["caster"]} 0 {0.01 - r["wheel"]}"/>{wheel}
    </body>
  </worldbody>
  <contact>{pair("left", friction)}{pair("right", friction)}{pair("caster", friction * r["caster_friction"])}</contact>
  <actuator><motor joint="left"/><motor joint="right"/></actuator>
</mujoco>""")


def mujoco_drive(friction, rows):
    """Rows of (t, x, y, heading)."""
    r = ROBOT
    m = model(friction)
    d = mujoco.MjData(m)
    for _ in range(round(0.5 / STEP)):  # settle on the contacts
        mujoco.mj_step(m, d)
    x0, y0 = d.qpos[0], d.qpos[1]
    rim, wound = [0.0, 0.0], [0.0, 0.0]
    speeds = [m.joint("left").dofadr[0], m.joint("right").dofadr[0]]
    every, path, k = round(SAMPLE / STEP), [], 0

    def sample(t):
        w, _, _, z = d.qpos[3:7]
        path.append((t, d.qpos[0] - x0, d.qpos[1] - y0, 2 * math.atan2(z, w)))

    sample(0.0)
    for (t0, v, omega), (t1, _, _) in zip(rows, rows[1:]):
        target = [v - omega * r["track"] / 2, v + omega * r["track"] / 2]
        for _ in range(round((t1 - t0) / STEP)):
            gap = [goal - have for goal, have in zip(target, rim)]
            share = min(1.0, r["acceleration"] * STEP / max(1e-12, max(abs(g) for g in gap)))
            for i in range(2):
                rim[i] += gap[i] * share
                reference = rim[i] / r["wheel"]
                d.ctrl[i] = r["stall"] * (r["kp"] * reference + r["ki"] * wound[i])
            mujoco.mj_step(m, d)
            for i in range(2):
                wound[i] += (rim[i] / r["wheel"] - d.qvel[speeds[i]]) * STEP
            k += 1
            if k % every == 0:
                sample(k * STEP)
    return path


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--wayhome", default="target/release/wayhome", help="the program")
    parser.add_argument("--out", default="results/physics/mujoco.csv")
    args = parser.parse_args()
    binary = pathlib.Path(args.wayhome).resolve()
    lines = ["drive,t_s,x_m,y_m,heading_rad,x_stiff_m,y_stiff_m,heading_stiff_rad,x_mujoco_m,y_mujoco_m,heading_mujoco_rad"]
    for name, (friction, rows) in DRIVES.items():
        ours = {}
        for creep in CREEPS:
            with tempfile.TemporaryDirectory() as folder:
                ours[creep] = wayhome(binary, friction, creep, rows, pathlib.Path(folder))
        theirs = mujoco_drive(friction, rows)
        for creep, path in ours.items():
            assert len(path) == len(theirs) and all(abs(a[0] - b[0]) < 1e-9 for a, b in zip(path, theirs)), name
            apart = [math.hypot(a[1] - b[1], a[2] - b[2]) for a, b in zip(path, theirs)]
            turn = math.degrees(math.remainder(theirs[-1][3] - path[-1][3], 2 * math.pi))
            print(f"{name:23} creep {creep:7} m/s: end {1e3 * apart[-1]:6.2f} mm, most {1e3 * max(apart):6.2f} mm, {turn:7.3f} deg")
        for a, b, c in zip(ours[CREEPS[0]], ours[CREEPS[1]], theirs):
            lines.append(",".join([name, *(f"{value:.6f}" for value in (*a, *b[1:], *c[1:]))]))
    pathlib.Path(args.out).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
