#include "server/wire/issues.h"

#include "server/wire/readable.h"

namespace limber::server {

proto::Issue encode_issue(const scene::Issue& issue, const std::string& prefix) {
  proto::Issue message;
  message.set_severity(issue.severity == scene::Issue::Severity::kError
                           ? proto::Issue::SEVERITY_ERROR
                           : proto::Issue::SEVERITY_WARNING);
  message.set_field(issue.field.empty() ? issue.field : field_text(prefix + issue.field));
  message.set_message(message_text(issue.message));
  if (issue.severity == scene::Issue::Severity::kError) message.set_code(to_proto(issue.code));
  return message;
}

proto::Issue encode_warning(const std::string& field, const std::string& text) {
  proto::Issue message;
  message.set_severity(proto::Issue::SEVERITY_WARNING);
  message.set_field(field_text(field));
  message.set_message(message_text(text));
  return message;
}

proto::Issue encode_fault(const Faults::Fault& fault) {
  proto::Issue message;
  message.set_severity(proto::Issue::SEVERITY_ERROR);
  message.set_field(field_text(fault.field));
  message.set_message(message_text(fault.message));
  message.set_code(fault.code);
  return message;
}

}  // namespace limber::server
