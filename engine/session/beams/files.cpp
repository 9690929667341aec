#include "engine/session/beams/files.h"

#include <charconv>
#include <cmath>

#include "engine/scene/formats/json_writer.h"
#include "engine/scene/formats/vtk_xml_writer.h"
#include "engine/session/beams/table.h"

namespace limber::session {
namespace {

using detail::BeamColumn;
using scene::Precision;
using scene::formats::JsonWriter;
using scene::formats::VtkXmlWriter;

/// Appends nothing for an unknown value.
void append(std::string& text, double value) {
  if (!std::isfinite(value)) return;
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

void append_row(std::string& text, const std::vector<BeamColumn>& columns, Eigen::Index row) {
  for (const BeamColumn& column : columns) {
    text += ',';
    append(text, column.values[row]);
  }
  text += '\n';
}

void append_heading(std::string& text, const std::vector<BeamColumn>& columns) {
  for (const BeamColumn& column : columns) {
    text += ',';
    text += column.name;
  }
  text += '\n';
}

void vectors(VtkXmlWriter& vtu, const char* name, const Eigen::Matrix3Xd& values) {
  vtu.reals(Precision::kFloat64, name, 3, static_cast<std::size_t>(values.size()),
            [&](Eigen::Index i) { return values.data()[i]; });
}

void write_points(const BeamAnalysis& analysis, VtkXmlWriter& vtu) {
  const Eigen::Matrix3Xd& positions = analysis.solution.state.positions;
  vtu.open("PointData Vectors=\"displacement\"");
  vectors(vtu, "displacement", positions - analysis.structure.rest_state().positions);
  vectors(vtu, "rotation", detail::rotation_vectors(analysis.solution.state));
  vectors(vtu, "reaction_force", analysis.results.reaction_forces);
  vectors(vtu, "reaction_moment", analysis.results.reaction_moments);
  vtu.close("PointData");
}

void write_cells(const BeamAnalysis& analysis, VtkXmlWriter& vtu) {
  const auto& elements = analysis.structure.model().elements;
  const std::size_t count = elements.size();
  vtu.open("CellData");
  vtu.array<std::int32_t>("Int32", "section", 1, count, [&](Eigen::Index i) {
    return elements[static_cast<std::size_t>(i)].section;
  });
  for (const BeamColumn& column : detail::element_columns(analysis))
    vtu.reals(Precision::kFloat64, column.name.c_str(), 1, count,
              [&](Eigen::Index i) { return column.values[i]; });
  vtu.close("CellData");
  vtu.open("Points");
  vectors(vtu, "Points", analysis.solution.state.positions);
  vtu.close("Points");
  vtu.open("Cells");
  vtu.array<std::int32_t>("Int32", "connectivity", 1, 2 * count, [&](Eigen::Index i) {
    const beams::BeamElement& element = elements[static_cast<std::size_t>(i / 2)];
    return i % 2 == 0 ? element.start : element.finish;
  });
  vtu.array<std::int32_t>("Int32", "offsets", 1, count, [](Eigen::Index i) { return 2 * (i + 1); });
  vtu.array<std::uint8_t>("UInt8", "types", 1, count, [](Eigen::Index) { return 3; });
  vtu.close("Cells");
}

void write_beam_units(const std::vector<BeamColumn>& columns, JsonWriter& json) {
  for (const BeamColumn& column : columns) json.member(column.name, column.unit);
}

void write_row(const std::vector<BeamColumn>& columns, Eigen::Index row, JsonWriter& json) {
  for (const BeamColumn& column : columns) json.member(column.name, column.values[row]);
}

void write_stations(const std::vector<BeamColumn>& columns, Eigen::Index first, int count,
                    JsonWriter& json) {
  json.key("stations");
  json.begin_array();
  for (int i = 0; i < count; ++i) {
    json.begin_object();
    write_row(columns, first + i, json);
    json.end_object();
  }
  json.end_array();
}

/// The other results about the equilibrium; members without content are empty.
void write_remarks(const beams::BeamReport& report, JsonWriter& json) {
  json.key("snaps");
  json.begin_array();
  for (const beams::BeamSnap& snap : report.snaps) {
    json.begin_object();
    json.member("progress", snap.load_factor);
    json.member("turn", snap.turn);
    json.member("node", snap.node);
    json.end_object();
  }
  json.end_array();
  json.key("neutral_directions");
  json.begin_array();
  for (const beams::BeamNeutralDirection& direction : report.neutral_directions) {
    json.begin_object();
    json.member("node", direction.node);
    json.key("translation");
    json.numbers(direction.translation);
    json.key("rotation");
    json.numbers(direction.rotation);
    json.end_object();
  }
  json.end_array();
  json.key("unjudged_elements");
  json.begin_array();
  for (const int element : report.unjudged_elements) json.value(element);
  json.end_array();
}

void write_report(const BeamAnalysis& analysis, JsonWriter& json) {
  const beams::BeamReport& report = analysis.solution.report;
  const beams::BeamEnergies& energies = analysis.results.energies;
  json.member("status", to_string(report.status));
  json.member("method", to_string(report.method));
  json.member("message", report.message);
  json.member("residual", report.residual);
  json.member("load_factor", report.load_factor);
  write_remarks(report, json);
  const double largest = analysis.results.largest_utilisation;
  json.member("largest_utilisation", largest > 0 ? largest : std::nan(""));
  json.member("largest_bend", analysis.results.largest_bend);
  json.key("energies");
  json.begin_object();
  json.member("stretching", energies.stretching);
  json.member("torsion", energies.torsion);
  json.member("bending_2", energies.bending_2);
  json.member("bending_3", energies.bending_3);
  json.member("total", energies.total());
  json.end_object();
}

}  // namespace

std::string beam_vtu(const BeamAnalysis& analysis) {
  VtkXmlWriter vtu("UnstructuredGrid");
  write_points(analysis, vtu);
  write_cells(analysis, vtu);
  return vtu.finish("NumberOfPoints=\"" + std::to_string(analysis.structure.nodes()) +
                    "\" NumberOfCells=\"" + std::to_string(analysis.structure.elements()) + "\"");
}

std::string beam_nodes_csv(const BeamAnalysis& analysis) {
  const auto columns = detail::node_columns(analysis);
  std::string text = "node";
  append_heading(text, columns);
  for (int i = 0; i < analysis.structure.nodes(); ++i) {
    text += std::to_string(i);
    append_row(text, columns, i);
  }
  return text;
}

std::string beam_elements_csv(const BeamAnalysis& analysis) {
  const auto columns = detail::element_columns(analysis);
  std::string text = "element,start,finish";
  append_heading(text, columns);
  for (int i = 0; i < analysis.structure.elements(); ++i) {
    const auto& element = analysis.structure.model().elements[static_cast<std::size_t>(i)];
    text += std::to_string(i) + ',' + std::to_string(element.start) + ',' +
            std::to_string(element.finish);
    append_row(text, columns, i);
  }
  return text;
}

std::string beam_stations_csv(const BeamAnalysis& analysis, int stations) {
  const auto columns = detail::station_columns(analysis, stations);
  std::string text = "element";
  append_heading(text, columns);
  for (int i = 0; i < analysis.structure.elements(); ++i) {
    for (int k = 0; k < stations; ++k) {
      text += std::to_string(i);
      append_row(text, columns, static_cast<Eigen::Index>(i) * stations + k);
    }
  }
  return text;
}

std::string beam_json(const BeamAnalysis& analysis, int stations) {
  const auto along =
      stations > 0 ? detail::station_columns(analysis, stations) : std::vector<BeamColumn>();
  const auto nodes = detail::node_columns(analysis), elements = detail::element_columns(analysis);
  JsonWriter json;
  json.begin_object();
  write_report(analysis, json);
  json.key("units");
  json.begin_object();
  write_beam_units(nodes, json);
  write_beam_units(elements, json);
  json.member("turn", "rad");
  json.member("translation", "m");
  json.member("rotation", "rad");
  // Columns of stations, in addition to those of elements.
  json.member("place", "1");
  json.member("moment_2", "N m");
  json.member("moment_3", "N m");
  json.end_object();
  json.key("nodes");
  json.begin_array();
  for (int i = 0; i < analysis.structure.nodes(); ++i) {
    json.begin_object();
    write_row(nodes, i, json);
    json.end_object();
  }
  json.end_array();
  json.key("elements");
  json.begin_array();
  for (int i = 0; i < analysis.structure.elements(); ++i) {
    const auto& element = analysis.structure.model().elements[static_cast<std::size_t>(i)];
    json.begin_object();
    json.member("start", element.start);
    json.member("finish", element.finish);
    write_row(elements, i, json);
    if (stations > 0)
      write_stations(along, static_cast<Eigen::Index>(i) * stations, stations, json);
    json.end_object();
  }
  json.end_array();
  json.end_object();
  return json.text() + "\n";
}

}  // namespace limber::session
