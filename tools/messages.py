#!/usr/bin/env python3
"""C++ structs, or IDL for another DDS, of the .msg files in a folder with a folder for each package.

usage: messages.py cpp|idl FOLDER OUTPUT [--namespace NAME] [--include HEADER]...

The format is ROS 2's (comments, constants, fields with defaults), with what it cannot say in comments:
    #@ name NAME              the message's name, if it is not the file's: there are several of that name
    #@ ros2_package PACKAGE   ROS 2 has it in another package
    #@ ros1_only              ROS 2 does not have it
    TYPE NAME  # @ros1 ...    a field that only ROS 1 has; @ros2 likewise; @ros1:NAME: its name in ROS 1
    TYPE NAME  # @cpp:TYPE    its type in C++
A comment above fields is that of all down to the next empty line.
"""
import argparse
import pathlib
import re
import sys

NUMBERS = {
    "bool": ("bool", "false", "boolean"), "byte": ("Octet", "", "octet"),
    "int8": ("std::int8_t", "0", "int8"), "uint8": ("std::uint8_t", "0", "octet"),
    "int16": ("std::int16_t", "0", "short"), "uint16": ("std::uint16_t", "0", "unsigned short"),
    "int32": ("std::int32_t", "0", "long"), "uint32": ("std::uint32_t", "0", "unsigned long"),
    "int64": ("std::int64_t", "0", "long long"), "uint64": ("std::uint64_t", "0", "unsigned long long"),
    "float32": ("float", "0.0f", "float"), "float64": ("double", "0.0", "double"),
    "string": ("std::string", "", "string"),
}


class Field:
    def __init__(self, kind, name, default, comment):
        self.item, self.many = re.fullmatch(r"([\w/]+)(\[\d*\])?", kind).groups()
        self.many = self.many or ""
        self.name, self.default = name, default
        tags, self.comment = re.fullmatch(r"((?:@\S+ ?)*)(.*)", comment or "").groups()
        self.ros, self.ros1_name, self.cpp = None, name, None
        for tag in tags.split():
            word, _, value = tag[1:].partition(":")
            if word == "cpp":
                self.cpp = value
            elif word == "ros1" and value:
                self.ros1_name = value
            elif word in ("ros1", "ros2"):
                self.ros = int(word[-1])
            else:
                raise ValueError(f"{tag} is not known")

    def member(self):
        return "point_fields" if self.name == "fields" else self.name  # the visitor's name

    def cpp_type(self):
        item = self.cpp or (NUMBERS[self.item][0].replace("Octet", "msg::Octet") if self.item in NUMBERS else self.item.split("/")[-1])
        if not self.many:
            return item
        size = self.many[1:-1]
        return f"std::array<{item}, {size}>" if size else f"std::vector<{item}>"

    def initial(self):
        if self.many or self.cpp or self.item not in NUMBERS:
            if self.cpp and self.default:
                return f" = {self.cpp}{{{self.default}}}"
            inside = self.default[1:-1] if self.default else ""
            return f"{{{inside}}}" if self.many[1:-1] or self.cpp else ""
        value = self.default or NUMBERS[self.item][1]
        if self.item == "float32" and not value.endswith("f"):
            value += "f" if "." in value else ".0f"
        return f" = {value}" if value else "{}" if self.item == "byte" else ""


class Message:
    def __init__(self, path):
        self.package, self.cpp_name = path.parent.name, path.stem
        self.name, self.ros2_package, self.ros1_only = path.stem, self.package, False
        self.constants, self.groups, self.comment = [], [], []
        above, fresh = [], True
        for number, line in enumerate(path.read_text().splitlines(), 1):
            try:
                fresh = self.read(line.rstrip(), above, fresh)
            except (ValueError, AttributeError) as fault:  # AttributeError: it fits no pattern
                why = fault if isinstance(fault, ValueError) else "expected TYPE NAME [DEFAULT]"
                sys.exit(f"{path}:{number}: {line!r}: {why}")

    def read(self, line, above, fresh):
        """One line; `above`: comments since the last field. True if the next field begins a group."""
        if line.startswith("#@ "):
            word, _, value = line[3:].partition(" ")
            if word not in ("name", "ros2_package", "ros1_only"):
                raise ValueError(f"{word} is not known")
            setattr(self, word, value or True)
        elif line.startswith("#"):
            above.append(line[1:].strip())
            return True
        elif not line:
            if above and not self.comment and not self.groups:
                self.comment = above[:]
            above.clear()
            return True
        elif constant := re.fullmatch(r"(\w+) (\w+) *= *(\S+)", line):
            self.constants.append((line, *constant.groups()))
        else:
            kind, name, default, comment = re.fullmatch(
                r"(\S+) (\w+)(?: (\[.*\]|[^#\s]+))?(?:\s+# (.*))?", line).groups()
            if fresh or not self.groups:
                self.groups.append((above[:], []))
                above.clear()
            self.groups[-1][1].append(Field(kind, name, default, comment))
            return False
        return fresh

    def finish(self):
        if not self.comment:
            sys.exit(f"{self.package}/{self.cpp_name}: there is no comment at its head")

    def fields(self):
        return [field for _, fields in self.groups for field in fields]

    def uses(self):
        return [field.item for field in self.fields() if field.item not in NUMBERS]


def read_messages(folder):
    """All messages, each after those that it holds."""
    found = {}
    for path in sorted(pathlib.Path(folder).glob("*/*.msg")):
        message = Message(path)
        if not message.comment:  # a file of nothing but a comment
            message.comment = [l[1:].strip() for l in path.read_text().splitlines() if re.match(r"#(?!@)", l)]
        message.finish()
        found[f"{message.package}/{message.cpp_name}"] = message
    if not found:
        sys.exit(f"{folder}: there are no messages (PACKAGE/NAME.msg)")
    ordered = []

    def place(name):
        if name not in found:
            sys.exit(f"{folder}: there is no message {name}")
        if found[name] in ordered:
            return
        for used in found[name].uses():
            place(used)
        ordered.append(found[name])

    for name in found:
        place(name)
    return ordered


def cpp_of(message):
    yield from (f"/// {line}" for line in message.comment)
    yield f"struct {message.cpp_name} {{"
    parts = [f'"{message.package}"', f'"{message.name}"', f'"{message.ros2_package}"',
             "".join(f'\n      "{line}\\n"' for line, *_ in message.constants) or '""',
             "true" if message.ros1_only else "false"]
    yield "  /// Package and name in both ROSes, with the constants of the definition."
    yield f"  static constexpr msg::TypeName kType{{{', '.join(parts)}}};"
    if message.constants:
        yield "  /// As the definition has them.\n  ///@{"
        for _, kind, name, value in message.constants:
            yield f"  static constexpr {NUMBERS[kind][0].replace('Octet', 'std::uint8_t')} {name} = {value};"
        yield "  ///@}"
    for above, fields in message.groups:
        many = len(fields) > 1 and above
        yield from (f"  /// {line}" for line in above)
        if many:
            yield "  ///@{"
        for field in fields:
            comment = f"  ///< {field.comment}" if field.comment else ""
            yield f"  {field.cpp_type()} {field.member()}{field.initial()};{comment}"
        if many:
            yield "  ///@}"
    if not message.groups:
        yield "  std::uint8_t none = 0;  ///< Of no meaning: see msg::kNoField."
    yield "  /// Calls `v(name, field)` for each field, in the order of the wire of ROS `V::kRos`."
    yield "  template <class M, class V>"
    yield "  static void fields(M& m, V& v) {"
    if not message.groups:
        yield "    if constexpr (V::kRos == 2) v(msg::kNoField, m.none);"
    for field in message.fields():
        condition = f"if constexpr (V::kRos == {field.ros}) " if field.ros else ""
        name = f'"{field.name}"'
        if field.ros1_name != field.name:
            name = f'V::kRos == 1 ? "{field.ros1_name}" : {name}'
        yield f"    {condition}v({name}, m.{field.member()});"
    yield "  }"
    yield "  /// Field by field."
    yield f"  bool operator==(const {message.cpp_name}&) const = default;"
    yield "};\n"


def cpp(messages, namespace, includes):
    yield "// Made by tools/messages.py."
    yield "#pragma once\n"
    yield "#include <array>\n#include <cstdint>\n#include <string>\n#include <vector>\n"
    yield from (f'#include "{header}"' for header in includes)
    yield f"\nnamespace pointflight::{namespace} {{\n"
    for message in messages:
        yield from cpp_of(message)
    yield f"}}  // namespace pointflight::{namespace}"


def idl(messages):
    """As rmw mangles names."""
    for message in messages:
        if message.ros1_only or re.search("_(Request|Response)$", message.name):  # services have a head of their own
            continue
        fields = []
        for field in (f for f in message.fields() if f.ros != 1):
            package, _, name = field.item.partition("/")
            kind = NUMBERS[field.item][2] if not name else f"{package}::msg::dds_::{name}_"
            if field.many == "[]":
                fields.append(f"sequence<{kind}> {field.name};")
            else:
                fields.append(f"{kind} {field.name}{field.many};")
        fields = fields or ["octet structure_needs_at_least_one_member;"]
        package = message.ros2_package
        yield f"module {package} {{ module msg {{ module dds_ {{"
        yield f"  struct {message.name}_ {{ {' '.join(fields)} }};"
        yield "}; }; };"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("language", choices=["cpp", "idl"])
    parser.add_argument("folder")
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--namespace", default="msg")
    parser.add_argument("--include", action="append", default=[])
    given = parser.parse_args()
    messages = read_messages(given.folder)
    lines = idl(messages) if given.language == "idl" else cpp(messages, given.namespace, given.include)
    text = "\n".join(lines) + "\n"
    if not given.output.exists() or given.output.read_text() != text:  # what includes it is not built anew
        given.output.parent.mkdir(parents=True, exist_ok=True)
        given.output.write_text(text)


main()
