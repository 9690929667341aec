#include "bench/linkage_models.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

namespace limber::bench {

const std::vector<LinkageCase>& linkage_cases() {
  constexpr auto kDrawn = RestLengthChoice::kDrawn;
  constexpr auto kSolved = RestLengthChoice::kSolved;
  // Rectangles: 3 x 0.75 of E = 3000, 1.5 x 10 of 2000, 13 x 9 of 20000, 12 x 8 of 2000; hourglass
  // with the section of asymm.
  static const std::vector<LinkageCase> cases = {
      {"burd_5",
       "burd_flat_opt_scaled",
       5,
       {6750, 5062.5, 316.40625, 386.3121963558732},
       20,
       95,
       50,
       kDrawn,
       0.06551205849886217,
       43.49874337567044,
       0,
       0},
      {"burd",
       "burd_flat_opt_scaled",
       10,
       {6750, 5062.5, 316.40625, 386.3121963558732},
       20,
       95,
       50,
       kDrawn,
       0.06523042613060336,
       43.312507597142925,
       3.9,
       0.8},
      {"burd_solved",
       "burd_flat_opt_scaled",
       10,
       {6750, 5062.5, 316.40625, 386.3121963558732},
       20,
       95,
       50,
       kSolved,
       0.06516696420644945,
       43.31263417905001,
       3.9,
       0.8},
      {"burd_20",
       "burd_flat_opt_scaled",
       20,
       {6750, 5062.5, 316.40625, 386.3121963558732},
       20,
       95,
       50,
       kDrawn,
       0.0651515779525022,
       43.27535043206037,
       0,
       0},
      {"burd_40",
       "burd_flat_opt_scaled",
       40,
       {6750, 5062.5, 316.40625, 386.3121963558732},
       20,
       95,
       50,
       kDrawn,
       0.06512391871666919,
       43.267049465093265,
       0,
       0},
      {"burd_80",
       "burd_flat_opt_scaled",
       80,
       {6750, 5062.5, 316.40625, 386.3121963558732},
       20,
       95,
       50,
       kDrawn,
       0.06511264696364637,
       43.26507852702259,
       0,
       0},
      {"etienne",
       "etienne_hyperboloid_measured",
       10,
       {30000, 250000, 5625, 7836},
       74,
       67.5,
       25,
       kSolved,
       7.3758469502943025e-06,
       253.12622115511329,
       10.9,
       4.9},
      {"darth_vader",
       "darth_vader_pavilion",
       10,
       {2340000, 32955000, 15795000, 13920760},
       18,
       105,
       50,
       kSolved,
       21314.890648254794,
       367575.160996227,
       26.3,
       6.1},
      {"asymm_2_bumps",
       "AsymmOverhanging2BumpsArchitecturalScale",
       10,
       {192000, 2304000, 1024000, 925198},
       182,
       93,
       50,
       kDrawn,
       41.548352371857526,
       13062.061460538143,
       34.7,
       16},
      {"hourglass",
       "hourglass",
       8,
       {192000, 2304000, 1024000, 925198},
       0,
       90,
       50,
       kDrawn,
       0,
       0,
       153.5,
       37.6},
  };
  return cases;
}

const LinkageCase& linkage_case(std::string_view name) {
  const auto& cases = linkage_cases();
  return *std::find_if(cases.begin(), cases.end(),
                       [&](const LinkageCase& one) { return one.name == name; });
}

std::optional<std::string> find_linkage_lines(const SuiteOptions& options, const std::string& name,
                                              const std::string& file, Recorder& recorder) {
  std::string path = options.shared_folder + "/data/linkages/" + file + ".obj";
  if (!options.shared_folder.empty() && std::filesystem::exists(path)) return path;
  recorder.note(fmt::format("{} left out: {} is not there", name, path));
  return std::nullopt;
}

}  // namespace limber::bench
