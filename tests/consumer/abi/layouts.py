#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""The project's own types in what abidw wrote: size, and each member with its place and, where the name is the same
with every compiler, its type; the values of enumerations.

    layouts.py FILE.abi
"""

import sys
import xml.etree.ElementTree as ElementTree

root = ElementTree.parse(sys.argv[1]).getroot()
names = {}
for node in root.iter():
    if "id" in node.attrib:
        names[node.get("id")] = node


def type_of(identity):
    """Of numbers and of own types; libraries name theirs otherwise from version to version."""
    node = names.get(identity)
    if node is None:
        return "?"
    if node.tag == "type-decl" or node.get("id") in own:
        return node.get("name")
    if node.tag == "array-type-def":
        return f"{type_of(node.get('type-id'))}[{node.get('size-in-bits')} bits]"
    return "..."


own, found = set(), []


def collect(node, scope):
    for child in node:
        if child.tag == "namespace-decl":
            if child.get("name") == "vlp":
                collect(child, "vlp::")
        elif child.tag in ("class-decl", "enum-decl"):
            name = child.get("name")
            if scope or name.startswith("vlp_"):
                own.add(child.get("id"))
                if child.get("is-declaration-only") != "yes":
                    found.append((scope + name, child))
            if scope:
                for member in child.findall("member-type"):
                    collect(member, f"{scope}{name}::")


for unit in root.findall("abi-instr"):
    collect(unit, "")

lines = set()
for name, node in found:
    if node.tag == "enum-decl":
        values = [f"{e.get('name')} {e.get('value')}" for e in node.findall("enumerator")]
        lines.add(f"{name}: " + ", ".join(values))
        continue
    lines.add(f"{name}: {node.get('size-in-bits')} bits")
    for member in node.findall("data-member"):
        offset = member.get("layout-offset-in-bits")
        variable = member.find("var-decl")
        if offset is not None:
            kind = type_of(variable.get("type-id"))
            lines.add(f"{name}: {int(offset):6} {variable.get('name')}, {kind}")
print("\n".join(sorted(lines)))
