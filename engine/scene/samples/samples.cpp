#include "engine/scene/samples/samples.h"

#include "engine/base/error.h"
#include "engine/scene/samples/sample_parts.h"

namespace limber::scene {
namespace {

struct Sample {
  const char* name;
  Scene (*make)();
};

constexpr Sample kSamples[] = {
    {"beam", samples::make_beam},
    {"flower", samples::make_flower},
    {"bird", samples::make_bird},
    {"dino", samples::make_dino},
};

}  // namespace

const std::vector<std::string>& sample_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Sample& sample : kSamples) result.emplace_back(sample.name);
    return result;
  }();
  return names;
}

Scene make_sample(const std::string& name) {
  for (const Sample& sample : kSamples) {
    if (name == sample.name) return sample.make();
  }
  std::string known;
  for (const Sample& sample : kSamples)
    known += (known.empty() ? "" : ", ") + std::string(sample.name);
  throw Error(ErrorCode::kNotFound, "sample",
              "there is no sample '" + name + "'; there are " + known);
}

}  // namespace limber::scene
