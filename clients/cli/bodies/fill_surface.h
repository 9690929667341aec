#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cli/context.h"
#include "limber/v1/scene.pb.h"

namespace limber::cli::bodies {

/// With how many tets the server fills a surface.
struct Filling {
  std::optional<std::uint32_t> tets;  // --tets: about so many
  std::optional<double> within;       // --within: a share of the body's length
  [[nodiscard]] bool is_given() const { return tets || within; }
};

/// The tets that fill the surface of a file, as a scene with the server's defaults. Their distance
/// from it is reported on stderr. @throws ClientError naming the option that is refused
[[nodiscard]] v1::Scene fill_surface(Context& context, const std::string& surface,
                                     const Filling& filling, double wait_s);

}  // namespace limber::cli::bodies
