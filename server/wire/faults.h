#pragma once

#include <string>
#include <vector>

#include "server/wire/errors.h"

namespace limber::server {

/// Treatment of unreadable values by decoding. Throws the first, for callers that need the value;
/// or it notes each and continues with a default, for callers that list all.
class Faults {
 public:
  enum class Mode { kThrow, kCollect };
  struct Fault {
    proto::ErrorCode code;
    std::string field, message;
  };

  explicit Faults(Mode mode) : mode_(mode) {}

  /// @returns whether `read` succeeded. @throws its exceptions, in kThrow
  template <class Read>
  bool try_to(const Read& read) {
    try {
      read();
      return true;
    } catch (const Refusal& fault) {
      if (mode_ == Mode::kThrow) throw;
      found_.push_back({fault.code(), fault.field(), fault.what()});
    } catch (const Error& fault) {
      if (mode_ == Mode::kThrow) throw;
      found_.push_back({to_proto(fault.code()), fault.field(), fault.what()});
    }
    return false;
  }

  /// Reads entry i of a list for i in [0, count), but no further than kMaxListedIssues faults.
  /// @param field  of the list
  template <class Read>
  void try_each(const std::string& field, int count, const Read& read) {
    int wrong = 0;
    for (int i = 0; i < count; ++i) {
      if (try_to([&] { read(i); }) || ++wrong < kMaxListedIssues) continue;
      found_.push_back(
          {proto::ERROR_CODE_INVALID_ARGUMENT, field,
           "there may be more such values; the first " + std::to_string(wrong) + " are listed"});
      return;
    }
  }

  [[nodiscard]] const std::vector<Fault>& found() const { return found_; }

 private:
  static constexpr int kMaxListedIssues = 20;

  Mode mode_;
  std::vector<Fault> found_;
};

}  // namespace limber::server
