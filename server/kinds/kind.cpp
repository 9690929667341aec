#include "server/kinds/kind.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "server/wire/errors.h"

namespace limber::server {

proto::Scene Kind::sample(const std::string& name) const {
  throw Error(ErrorCode::kNotFound, "name", fmt::format("there is no sample '{}'", name));
}

Kinds& Kinds::add(std::unique_ptr<const Kind> kind) {
  kinds_.push_back(std::move(kind));
  return *this;
}

const Kind& Kinds::of(const proto::Scene& scene, const std::string& field) const {
  for (const auto& kind : kinds_)
    if (kind->accepts(scene)) return *kind;
  std::vector<std::string> names;
  for (const auto& kind : kinds_) names.emplace_back(kind->name());
  throw Refusal(proto::ERROR_CODE_UNSUPPORTED, field,
                fmt::format("The scene is of no kind that this server has; it has {}",
                            fmt::join(names, ", ")));
}

std::vector<std::string> Kinds::sample_names() const {
  std::vector<std::string> all;
  for (const auto& kind : kinds_)
    for (auto& name : kind->sample_names()) all.push_back(std::move(name));
  return all;
}

proto::Scene Kinds::sample(const std::string& name) const {
  for (const auto& kind : kinds_) {
    const auto names = kind->sample_names();
    if (std::find(names.begin(), names.end(), name) != names.end()) return kind->sample(name);
  }
  throw Error(
      ErrorCode::kNotFound, "name",
      fmt::format("there is no sample '{}'; there are {}", name, fmt::join(sample_names(), ", ")));
}

bool Kinds::are_heavy(const proto::EditRequest& request) const {
  const auto& edits = request.edits();
  return std::any_of(edits.begin(), edits.end(), [&](const proto::Edit& edit) {
    return std::any_of(kinds_.begin(), kinds_.end(),
                       [&](const auto& kind) { return kind->is_heavy(edit); });
  });
}

bool Kinds::answer(const proto::Request& request, proto::Reply& reply, Hub& hub,
                   const SceneContext& context) const {
  return std::any_of(kinds_.begin(), kinds_.end(),
                     [&](const auto& kind) { return kind->answer(request, reply, hub, context); });
}

}  // namespace limber::server
