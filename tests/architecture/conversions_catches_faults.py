#!/usr/bin/env python3
"""The check of conversions must be able to fail: each of these lines must be named, and nothing of what is allowed."""

import sys

import conversions

READER, OTHER = "engine/scene/formats/a.cpp", "engine/beams/a.cpp"
OWN = "engine/session/linkages/live_design.cpp"
assert conversions.own_of(OWN) == {"middle"}
FAULTS = [
    (OTHER, "const int port = std::stoi(text);"),
    (OTHER, "auto n = std::stoull(text);"),
    ("clients/cpp/a.cpp", "long number = std::strtol(text, nullptr, 10);"),
    ("clients/cli/a.cpp", "int n = atoi(text);"),
    ("server/cli/a.cpp", "sscanf(text, \"%d\", &n);"),
    (READER, "std::from_chars(begin, end, value);"),
    ("server/wire/a.cpp", "std::from_chars(begin, end, value);"),
    (OTHER, "fixed.directions[direction.get<std::size_t>()] = true;"),
    (OTHER, "visit(entry[0].get<int>());"),
    (OTHER, "visit(entry[0].get<std::int64_t>());"),
    (OTHER, "visit(entry[0].get<unsigned long>());"),
    (OTHER, "n = options[\"n\"].as<unsigned>();"),
    (OTHER, "node.attribute(\"offset\").as_ullong(0);"),
    (OTHER, "CLI::detail::lexical_cast<int>(text, value);"),
    (READER, "corners.push_back(static_cast<int>(value));"),
    (READER, "mesh.edges(end, e) =\n    static_cast<int>(\n        index);"),
    ("server/kinds/beams/a.cpp", "const auto node = static_cast<int>(edit.hold_beam_node().node());"),
    ("server/kinds/linkages/a.cpp", "options.rows = static_cast<int>(request.rows());"),
    ("server/wire/a.h", "const auto undo = static_cast<int>(message.undo_count());"),
    ("clients/cpp/linkages/a.cpp", "vertices.push_back(static_cast<std::int32_t>(vertex));"),
    ("clients/cli/a.cpp", "const int count = static_cast<int>(number);"),
    ("clients/cli/linkages/a.cpp", "if (number == static_cast<unsigned>(number)) return {};"),
    ("clients/cpp/a.cpp", "grid.set_columns(static_cast<std::uint32_t>(columns));"),
    ("server/store/a.cpp", "const auto kind = static_cast<int>(row.number(2));"),
    ("server/store/a.cpp", "page = static_cast<std::uint32_t>(statement.number(0));"),
    ("server/store/a.cpp", "return sqlite3_column_int(statement_.get(), column);"),
    ("engine/session/bodies/a.cpp", "const int frame = static_cast<int>(edit.frame);"),
    ("engine/session/bodies/a.cpp", "return static_cast<int>(middle);"),  # another file's own
    (READER, "mesh.tets = numbers.cast<int>();"),
    (READER, "mesh.tets = numbers.template cast<std::int32_t>();"),
    (READER, "mesh.tets = numbers\n    .cast< Eigen::Index >();"),
    ("server/wire/arrays.cpp", "return map->cast<unsigned short>();"),
    ("server/wire/arrays.cpp", "return map.template cast<Number>();"),
    ("engine/session/linkages/a.cpp", "joints = values.cast<int>();"),
    (OWN, ""),  # what is named is gone
]
ALLOWED = [
    (conversions.CHECKED, "std::from_chars(text.data(), end, value);"),
    (OTHER, "place[k] = static_cast<int>(row);"),  # reads nothing
    (OTHER, "cells_ = count.cast<int>();"),
    (OWN, "return static_cast<int>(middle);"),
    ("server/store/a.cpp", "return static_cast<std::uint64_t>(sqlite3_column_int64(statement_.get(), column));"),
    ("engine/session/bodies/a.cpp", "result = positions.cast<float>() + rest.template cast<double>();"),
    ("server/wire/frames.cpp", "scale = extent.template cast<Number>();"),
    ("server/kinds/bodies/a.cpp", "info.set_modes(static_cast<std::uint32_t>(choice.modes));"),
    ("clients/cli/a.cpp", "const bool is = std::isdigit(static_cast<unsigned char>(text[0])) != 0;"),
    (READER, "// static_cast<int>(value) would cut off\n"),
    (READER, "entry.emplace_back(labels_[i], static_cast<int>(i));"),
    (READER, "const int nodes = static_cast<int>(positions.rows() / 3);"),
    (READER, "const auto count = to_whole<int>(value);"),
    (READER, "const auto result = value.get<double>();"),
    (READER, "if (const auto* number = value.get_ptr<const Json::number_unsigned_t*>())"),
    ("server/wire/a.h", "for (int value = 1; value <= static_cast<int>(kLast); ++value)"),
    ("server/kinds/bodies/a.cpp", "return static_cast<int>(\n    std::clamp<std::uint64_t>(bytes / each, 1, 1u << 20));"),
]

wrong = [f"not named: {path}: {text}" for path, text in FAULTS if len(conversions.faults_of_file(path, text)) != 1]
wrong += [f"named without reason: {path}: {text}" for path, text in ALLOWED if conversions.faults_of_file(path, text)]
print("\n".join(wrong) or f"{len(FAULTS)} faults were named")
sys.exit(1 if wrong else 0)
