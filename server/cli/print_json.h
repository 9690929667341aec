#pragma once

#include <google/protobuf/message.h>

namespace limber::server {

/// One line on standard output: fields by their names in proto, those that have their default
/// value included.
void print_json(const google::protobuf::Message& message);

}  // namespace limber::server
