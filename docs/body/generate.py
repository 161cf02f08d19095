#!/usr/bin/env python3
"""Writes config/leo.urdf and config/motor.toml from one definition of the body's 65 joints.

    python3 docs/body/generate.py            # from the repository's root

Every joint is one call of `joint` below, with its place in the tree, its axis, its limits, its servo and the
shapes of the link that it moves. Lengths are metres, masses kilograms, angles radians.

Frames follow REP 103: at the zero pose every link's frame is parallel to the base's (x forward, y left, z up),
yaw turns about z, pitch about y, roll about x. The base's origin lies under the neck in the plane of the table's
top. At the zero pose the arms hang down with the palms facing back; positive pitch closes a finger.

Servos are mounted so that the middle of their range is the joint's rest position (`offset_rad`): what powers up
at its middle stands at rest, with both hands above the table.

The published counts of the robot Leonardo's joints disagree; 65 is that of Berlin, Gray, Thomaz and Breazeal
(2006). How they are shared out is this project's own convention.
"""

import math
import os
from collections import namedtuple

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")

# What stands in a servo's data sheet, derated: the model's name, effort (N m), velocity (rad/s).
Servo = namedtuple("Servo", "model effort velocity acceleration")
LARGE = Servo("XM430-W350", 4.1, 3.0, 20.0)
SMALL = Servo("XL330-M288", 0.5, 5.0, 60.0)

Joint = namedtuple("Joint", "name parent child xyz axis lower upper servo bus rest group")
Shape = namedtuple("Shape", "kind size xyz rpy material")

MATERIALS = {
    "fur": "0.55 0.40 0.26 1",
    "cream": "0.90 0.82 0.66 1",
    "dark": "0.20 0.17 0.15 1",
    "white": "0.96 0.96 0.94 1",
    "rose": "0.80 0.48 0.44 1",
}
AXES = {"roll": (1, 0, 0), "pitch": (0, 1, 0), "yaw": (0, 0, 1)}
BUSES = ["face_left", "face_right", "left_arm", "right_arm", "torso"]

joints, links, fixed = [], {}, []


def box(x, y, z, at=(0, 0, 0), material="fur", rpy=(0, 0, 0)):
    return Shape("box", (x, y, z), at, rpy, material)


def cylinder(radius, length, at=(0, 0, 0), material="fur", rpy=(0, 0, 0)):
    return Shape("cylinder", (radius, length), at, rpy, material)


def sphere(radius, at=(0, 0, 0), material="fur"):
    return Shape("sphere", (radius,), at, (0, 0, 0), material)


def link(name, mass, *shapes):
    links[name] = (mass, shapes)


def joint(name, parent, xyz, lower, upper, servo, bus, mass, *shapes, rest=0.0, axis=None, group=None):
    """One revolute joint and the link that it moves, named after it."""
    child = name + "_link"
    axis = axis or AXES[name.rsplit("_", 1)[1]]
    joints.append(Joint(name + "_joint", parent, child, xyz, axis, lower, upper, servo, bus, rest, group or bus))
    link(child, mass, *shapes)
    return child


def frame(name, parent, xyz, rpy):
    """A frame fixed to a link."""
    fixed.append((name, parent, xyz, rpy))


def torso_and_neck():
    link("base_link", 6.0, box(0.16, 0.20, 0.22, (0, 0, -0.15), "dark"))
    yaw = joint("torso_yaw", "base_link", (0, 0, -0.02), -0.8, 0.8, LARGE, "torso", 0.4, cylinder(0.08, 0.04, (0, 0, 0.0), "dark"))
    pitch = joint("torso_pitch", yaw, (0, 0, 0.02), -0.2, 0.5, LARGE, "torso", 0.4, cylinder(0.05, 0.16, (0, 0, 0), "dark", (math.pi / 2, 0, 0)))
    torso = joint("torso_roll", pitch, (0, 0, 0), -0.3, 0.3, LARGE, "torso", 4.0,
                  box(0.18, 0.26, 0.36, (0, 0, 0.24)), sphere(0.11, (0.03, 0, 0.17), "cream"))
    yaw = joint("neck_yaw", torso, (0, 0, 0.45), -1.4, 1.4, LARGE, "torso", 0.15, cylinder(0.04, 0.04, (0, 0, 0)), group="neck")
    pitch = joint("neck_pitch", yaw, (0, 0, 0.02), -0.6, 0.9, LARGE, "torso", 0.15, cylinder(0.035, 0.06, (0, 0, 0.01)), group="neck")
    roll = joint("neck_roll", pitch, (0, 0, 0.01), -0.4, 0.4, LARGE, "torso", 0.15, cylinder(0.03, 0.05, (0, 0, 0.02)), group="neck")
    head = joint("head_pitch", roll, (0, 0, 0.04), -0.5, 0.7, LARGE, "torso", 0.9,
                 sphere(0.095, (-0.02, 0, 0.09)), box(0.08, 0.11, 0.07, (0.03, 0, 0.06), "cream"), group="neck")
    return torso, head


def face_half(side, head, jaw):
    """Fourteen joints of one half of the face; `s` is +1 on the left."""
    s, bus = (1, "face_left") if side == "left" else (-1, "face_right")

    def small(part, parent, xyz, lower, upper, mass, *shapes, **more):
        group = "ears" if part.startswith("ear") else "face"
        return joint(f"{side}_{part}", parent, xyz, lower, upper, SMALL, bus, mass, *shapes, group=group, **more)

    ear = small("ear_yaw", head, (-0.03, s * 0.08, 0.13), -0.7, 0.7, 0.01, sphere(0.012))
    ear = small("ear_pitch", ear, (0, 0, 0), -0.7, 0.7, 0.01, sphere(0.011))
    # Outwards is up on either side: the axis is mirrored with the ear.
    small("ear_roll", ear, (0, 0, 0), -0.8, 0.8, 0.04, box(0.015, 0.13, 0.055, (0, s * 0.07, 0.02)),
          box(0.004, 0.10, 0.035, (0.008, s * 0.07, 0.02), "rose"), axis=(s, 0, 0))
    eye = (0.06, s * 0.03, 0.10)
    yaw = small("eye_yaw", head, eye, -0.6, 0.6, 0.01, sphere(0.020, (0, 0, 0), "white"))
    pitch = small("eye_pitch", yaw, (0, 0, 0), -0.6, 0.6, 0.01, sphere(0.009, (0.014, 0, 0), "dark"))
    frame(f"{side}_eye", pitch, (0, 0, 0), (0, 0, 0))
    # Zero is open; positive closes.
    small("upper_eyelid_pitch", head, eye, -0.3, 0.9, 0.005, box(0.018, 0.044, 0.006, (0.014, 0, 0.018)))
    small("lower_eyelid_pitch", head, eye, -0.3, 0.7, 0.005, box(0.018, 0.044, 0.006, (0.014, 0, -0.018)), axis=(0, -1, 0))
    # Positive raises: brows, cheeks, the corners of the mouth and the lips turn about -y.
    up = (0, -1, 0)
    small("inner_brow_pitch", head, (0.05, s * 0.020, 0.128), -0.4, 0.6, 0.005, box(0.010, 0.020, 0.008, (0.025, 0, 0), "dark"), axis=up)
    small("outer_brow_pitch", head, (0.05, s * 0.042, 0.126), -0.4, 0.6, 0.005, box(0.010, 0.020, 0.008, (0.022, 0, 0), "dark"), axis=up)
    small("cheek_pitch", head, (0.04, s * 0.048, 0.055), -0.3, 0.5, 0.01, sphere(0.016, (0.018, 0, 0), "cream"), axis=up)
    corner = small("mouth_corner_pitch", head, (0.045, s * 0.036, 0.036), -0.6, 0.6, 0.005, sphere(0.005, (0, 0, 0), "rose"), axis=up)
    # Positive draws the corner outwards.
    small("mouth_corner_yaw", corner, (0, 0, 0), -0.4, 0.4, 0.005, sphere(0.006, (0.028, 0, 0), "rose"), axis=(0, 0, s))
    small("upper_lip_pitch", head, (0.045, s * 0.018, 0.040), -0.3, 0.5, 0.005, box(0.008, 0.018, 0.008, (0.030, 0, 0), "rose"), axis=up)
    small("lower_lip_pitch", jaw, (0.045, s * 0.018, 0.016), -0.3, 0.5, 0.005, box(0.008, 0.018, 0.008, (0.030, 0, 0), "rose"), axis=up)


def face(head):
    # Positive opens the mouth. The nose and the jaw hang on the left face's bus, the middle of the lips on the right's.
    up = (0, -1, 0)
    jaw = joint("jaw_pitch", head, (0.0, 0, 0.02), 0.0, 0.5, SMALL, "face_left", 0.05, box(0.07, 0.08, 0.02, (0.035, 0, 0.0), "cream"), group="face")
    face_half("left", head, jaw)
    joint("nose_pitch", head, (0.06, 0, 0.075), -0.3, 0.3, SMALL, "face_left", 0.005, sphere(0.012, (0.018, 0, 0), "dark"), axis=up, group="face")
    face_half("right", head, jaw)
    joint("upper_lip_pitch", head, (0.045, 0, 0.042), -0.3, 0.5, SMALL, "face_right", 0.005, box(0.008, 0.018, 0.008, (0.032, 0, 0), "rose"), axis=up, group="face")
    joint("lower_lip_pitch", jaw, (0.045, 0, 0.016), -0.3, 0.5, SMALL, "face_right", 0.005, box(0.008, 0.018, 0.008, (0.032, 0, 0), "rose"), axis=up, group="face")


UPPER_ARM, FOREARM, HAND = 0.34, 0.32, 0.12
SHOULDER = 0.18, 0.40
REST_ARM = {"shoulder_pitch": 0.40, "shoulder_roll": 0.15, "elbow_pitch": -2.30, "wrist_pitch": 0.30}


def arm_and_hand(side, torso):
    """Seven joints of an arm and six of its hand; roll and yaw limits are mirrored."""
    s, bus = (1, "left_arm") if side == "left" else (-1, "right_arm")

    def large(part, parent, xyz, lower, upper, mass, *shapes):
        axis = part.rsplit("_", 1)[1]
        if s < 0 and axis in ("roll", "yaw"):
            lower, upper = -upper, -lower
        rest = REST_ARM.get(part, 0.0) * (s if axis != "pitch" else 1)
        return joint(f"{side}_{part}", parent, xyz, lower, upper, LARGE, bus, mass, *shapes, rest=rest)

    shoulder = large("shoulder_pitch", torso, (0, s * SHOULDER[0], SHOULDER[1]), -2.6, 1.2, 0.25, cylinder(0.04, 0.06, (0, -s * 0.02, 0), "fur", (math.pi / 2, 0, 0)))
    shoulder = large("shoulder_roll", shoulder, (0, 0, 0), -0.5, 2.2, 0.25, sphere(0.05))
    upper = large("shoulder_yaw", shoulder, (0, 0, 0), -1.7, 1.7, 0.6, cylinder(0.038, UPPER_ARM - 0.06, (0, 0, -UPPER_ARM / 2)))
    forearm = large("elbow_pitch", upper, (0, 0, -UPPER_ARM), -2.45, 0.0, 0.2, sphere(0.04), cylinder(0.034, FOREARM / 2, (0, 0, -FOREARM / 4)))
    wrist = large("wrist_yaw", forearm, (0, 0, -FOREARM), -2.6, 2.6, 0.3, cylinder(0.030, FOREARM / 2, (0, 0, FOREARM / 4)))
    wrist = large("wrist_pitch", wrist, (0, 0, 0), -1.9, 1.9, 0.08, sphere(0.028))
    palm = large("wrist_roll", wrist, (0, 0, 0), -1.5, 1.5, 0.12, box(0.028, 0.072, 0.055, (0, 0, -0.032), "cream"))

    def finger(part, xyz, radius, length, **more):
        joint(f"{side}_{part}", palm, xyz, 0.0, 1.4, SMALL, bus, 0.015, cylinder(radius, length, (0, 0, -length / 2), "cream"),
              group=f"{side}_hand", **more)

    # The thumb stands on the palm's side (-x) and closes towards the fingers, so about -y.
    base = joint(f"{side}_thumb_yaw", palm, (-0.030, -s * 0.012, -0.045), 0.0, 1.4, SMALL, bus, 0.015,
                 sphere(0.011, (0, 0, 0), "cream"), axis=(0, 0, s), group=f"{side}_hand")
    joint(f"{side}_thumb_pitch", base, (0, 0, 0), 0.0, 1.4, SMALL, bus, 0.015, cylinder(0.009, 0.06, (0, 0, -0.03), "cream"),
          axis=(0, -1, 0), group=f"{side}_hand")
    for number, (part, length) in enumerate([("index", 0.066), ("middle", 0.070), ("ring", 0.066), ("little", 0.056)]):
        # With the palm facing back the thumb and the index finger are next to the body.
        finger(part + "_pitch", (0.004, s * (-0.027 + 0.018 * number), -0.058), 0.008, length)
    # x along the fingers, y to the left as the base's, z out of the back of the hand.
    frame(f"{side}_grasp", palm, (-0.012, 0, -HAND), (0, math.pi / 2, 0))


def number(value):
    text = f"{value:.6g}"
    return "0" if text == "-0" else text


def triple(values):
    return " ".join(number(value) for value in values)


def volume(shape):
    if shape.kind == "box":
        x, y, z = shape.size
        return x * y * z
    if shape.kind == "cylinder":
        radius, length = shape.size
        return math.pi * radius ** 2 * length
    return 4 / 3 * math.pi * shape.size[0] ** 3


def inertia(shape, mass):
    """Principal moments of a solid of even density, about its own axes."""
    if shape.kind == "box":
        x, y, z = shape.size
        return mass / 12 * (y * y + z * z), mass / 12 * (x * x + z * z), mass / 12 * (x * x + y * y)
    if shape.kind == "cylinder":
        radius, length = shape.size
        across = mass / 12 * (3 * radius ** 2 + length ** 2)
        along = mass / 2 * radius ** 2
        # The only turned cylinders lie along y.
        return (across, along, across) if shape.rpy[0] else (across, across, along)
    return (2 / 5 * mass * shape.size[0] ** 2,) * 3


def inertial(mass, shapes):
    """One line: the link's mass at the centre of its shapes, each counted by its volume."""
    total = sum(volume(shape) for shape in shapes)
    parts = [(shape, mass * volume(shape) / total) for shape in shapes]
    centre = [sum(part * shape.xyz[i] for shape, part in parts) / mass for i in range(3)]
    moments = [0.0, 0.0, 0.0]
    for shape, part in parts:
        own = inertia(shape, part)
        off = [shape.xyz[i] - centre[i] for i in range(3)]
        square = sum(value * value for value in off)
        for i in range(3):
            moments[i] += own[i] + part * (square - off[i] * off[i])
    ixx, iyy, izz = (number(max(value, 1e-8)) for value in moments)
    return (f'<inertial><origin xyz="{triple(centre)}"/><mass value="{number(mass)}"/>'
            f'<inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/></inertial>')


def geometry(shape):
    turned = f' rpy="{triple(shape.rpy)}"' if any(shape.rpy) else ""
    origin = f'<origin xyz="{triple(shape.xyz)}"{turned}/>'
    if shape.kind == "box":
        solid = f'<box size="{triple(shape.size)}"/>'
    elif shape.kind == "cylinder":
        solid = f'<cylinder radius="{number(shape.size[0])}" length="{number(shape.size[1])}"/>'
    else:
        solid = f'<sphere radius="{number(shape.size[0])}"/>'
    return f"{origin}<geometry>{solid}</geometry>"


def urdf():
    out = ['<?xml version="1.0"?>',
           "<!-- Written by docs/body/generate.py: change that and run it. Metres, kilograms, radians; REP 103.",
           "     base_link: under the neck, in the plane of the table's top; x forward, y left, z up. -->",
           '<robot name="leo">']
    out += [f'  <material name="{name}"><color rgba="{rgba}"/></material>' for name, rgba in MATERIALS.items()]
    for name, (mass, shapes) in links.items():
        out.append(f'  <link name="{name}">')
        out.append("    " + inertial(mass, shapes))
        for shape in shapes:
            out.append(f'    <visual>{geometry(shape)}<material name="{shape.material}"/></visual>')
        # What a hand or a block could meet: the first shape, which is the largest, of every link but the face's.
        if mass >= 0.08:
            out.append(f"    <collision>{geometry(shapes[0])}</collision>")
        out.append("  </link>")
    for j in joints:
        out.append(f'  <joint name="{j.name}" type="revolute"><parent link="{j.parent}"/><child link="{j.child}"/>'
                   f'<origin xyz="{triple(j.xyz)}"/><axis xyz="{triple(j.axis)}"/>'
                   f'<limit lower="{number(j.lower)}" upper="{number(j.upper)}" effort="{number(j.servo.effort)}" velocity="{number(j.servo.velocity)}"/></joint>')
    for name, parent, xyz, rpy in fixed:
        turn = " ".join("1.5707963267948966" if value else "0" for value in rpy)
        out.append(f'  <link name="{name}"/>')
        out.append(f'  <joint name="{name}_joint" type="fixed"><parent link="{parent}"/><child link="{name}"/>'
                   f'<origin xyz="{triple(xyz)}" rpy="{turn}"/></joint>')
    return "\n".join(out + ["</robot>", ""])


MOTOR_HEAD = """\
# The servo buses and the 65 joints on them. The index of a joint is its place in this file.
# Generated by docs/body/generate.py together with leo.urdf: change and run that script. Names and limits must be equal
# in both files; `leo check` reports differences.
#
# [[bus]]    a half-duplex line of servos
#   name     letters, digits and _; unique
#   device   "mock", or the path of a tty
#   baud     bits per second: 1, 2, 3, 4 or 4.5 million
# [[joint]]  a joint and its servo
#   name     unique, and the same as in the URDF
#   bus, id  the servo's bus, and its identifier there: 0 to 252, unique on the bus
#   model    "XM430-W350" (body) or "XL330-M288" (face and fingers)
#   sign     1, or -1 if the servo turns against the joint
#   offset_rad  servo = sign * joint + offset; the servo's zero is the middle of its turn, which here is the rest
#            position of the joint
#   min_rad, max_rad  lowest and highest position of the joint, as in the URDF
#   max_velocity_rad_s, max_acceleration_rad_s2  highest speed (as in the URDF) and acceleration of the joint; the servo's
#            profile is never faster than that speed
#   group    torque comes on one group after the other, in the order of this file; the joints of a group stop together,
#            and with them the groups that hang from it in the URDF
#   rest_rad  optional, default 0: the rest position without torque, to which the joint is lowered before its torque
#            goes off after some hardware alerts
#   max_tracking_error_rad  optional: as in leo.toml, for this joint
"""


def motor():
    out = [MOTOR_HEAD]
    for name in BUSES:
        out.append(f'[[bus]]\nname = "{name}"\ndevice = "mock"\nbaud = 4000000\n')
    ids = dict.fromkeys(BUSES, 0)
    for j in joints:
        ids[j.bus] += 1

        def decimal(value):
            text = number(value)
            return text if "." in text else text + ".0"

        out.append(f'[[joint]]\nname = "{j.name}"\nbus = "{j.bus}"\nid = {ids[j.bus]}\nmodel = "{j.servo.model}"\nsign = 1\n'
                   f'offset_rad = {decimal(-j.rest)}\nmin_rad = {decimal(j.lower)}\nmax_rad = {decimal(j.upper)}\n'
                   f'max_velocity_rad_s = {decimal(j.servo.velocity)}\nmax_acceleration_rad_s2 = {decimal(j.servo.acceleration)}\ngroup = "{j.group}"\n')
    return "\n".join(out)


def write(name, text):
    with open(os.path.join(ROOT, "config", name), "w", encoding="utf-8") as file:
        file.write(text)


def main():
    torso, head = torso_and_neck()
    for side in ("left", "right"):
        arm_and_hand(side, torso)
    face(head)
    assert len(joints) == 65, len(joints)
    write("leo.urdf", urdf())
    write("motor.toml", motor())


if __name__ == "__main__":
    main()
