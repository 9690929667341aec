#pragma once

#include <string>

#include "engine/base/error.h"
#include "server/wire/errors.h"

namespace limber::server::testing {

/// The field that a call is refused for; "accepted" where it is not.
template <class Call>
std::string refused_field(const Call& call) {
  try {
    call();
  } catch (const Refusal& refusal) {
    return refusal.field();
  } catch (const Error& error) {
    return error.field();
  }
  return "accepted";
}

}  // namespace limber::server::testing
