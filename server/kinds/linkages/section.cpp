#include "server/kinds/linkages/section.h"

#include <fmt/format.h>

#include "server/wire/arrays.h"

namespace limber::server {
namespace {

rods::Profile decode_profile(const proto::ProfileSection& message, const std::string& field) {
  rods::Profile profile;
  profile.outline = decode_polygon(message.outer(), field + ".outer");
  for (int i = 0; i < message.holes_size(); ++i) {
    profile.holes.push_back(
        decode_polygon(message.holes(i), fmt::format("{}.holes[{}]", field, i)));
  }
  return profile;
}

struct Encode {
  proto::RodSection& message;

  void operator()(const rods::Rectangle& section) const {
    message.mutable_rectangle()->set_width(section.width);
    message.mutable_rectangle()->set_height(section.height);
  }
  void operator()(const rods::Ellipse& section) const {
    message.mutable_ellipse()->set_width(section.width);
    message.mutable_ellipse()->set_height(section.height);
  }
  void operator()(const rods::ISection& section) const {
    auto& shape = *message.mutable_i();
    shape.set_height(section.height);
    shape.set_flange_width(section.flange_width);
    shape.set_flange_thickness(section.flange_thickness);
    shape.set_web_thickness(section.web_thickness);
  }
  void operator()(const rods::LSection& section) const {
    auto& shape = *message.mutable_l();
    shape.set_width(section.width);
    shape.set_height(section.height);
    shape.set_thickness(section.thickness);
  }
  void operator()(const rods::PlusSection& section) const {
    auto& shape = *message.mutable_plus();
    shape.set_width(section.width);
    shape.set_height(section.height);
    shape.set_thickness(section.thickness);
  }
  void operator()(const rods::Tube& section) const {
    message.mutable_tube()->set_diameter(section.diameter);
    message.mutable_tube()->set_wall_thickness(section.wall_thickness);
  }
  void operator()(const rods::Profile& section) const {
    auto& shape = *message.mutable_profile();
    *shape.mutable_outer() = encode_polygon(section.outline);
    for (const auto& hole : section.holes) *shape.add_holes() = encode_polygon(hole);
  }
};

}  // namespace

rods::Section decode_section(const proto::RodSection& message, const std::string& field) {
  switch (message.shape_case()) {
    case proto::RodSection::kRectangle:
      return rods::Rectangle{message.rectangle().width(), message.rectangle().height()};
    case proto::RodSection::kEllipse:
      return rods::Ellipse{message.ellipse().width(), message.ellipse().height()};
    case proto::RodSection::kI:
      return rods::ISection{message.i().height(), message.i().flange_width(),
                            message.i().flange_thickness(), message.i().web_thickness()};
    case proto::RodSection::kL:
      return rods::LSection{message.l().width(), message.l().height(), message.l().thickness()};
    case proto::RodSection::kPlus:
      return rods::PlusSection{message.plus().width(), message.plus().height(),
                               message.plus().thickness()};
    case proto::RodSection::kTube:
      return rods::Tube{message.tube().diameter(), message.tube().wall_thickness()};
    case proto::RodSection::kProfile:
      return decode_profile(message.profile(), field + ".profile");
    case proto::RodSection::SHAPE_NOT_SET:
      break;
  }
  throw invalid(field, "missing: which cross-section the rods have");
}

proto::RodSection encode_section(const rods::Section& section) {
  proto::RodSection message;
  std::visit(Encode{message}, section);
  return message;
}

}  // namespace limber::server
