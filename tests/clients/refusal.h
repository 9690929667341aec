#pragma once

#include <stdexcept>

#include "clients/cpp/error.h"

namespace limber::client {

/// What a call throws. @throws std::logic_error where it throws nothing
template <class Call>
ClientError refusal(const Call& call) {
  try {
    call();
  } catch (const ClientError& error) {
    return error;
  }
  throw std::logic_error("nothing was refused");
}

}  // namespace limber::client
