#include "server/runtime/run.h"

#include <fmt/format.h>

#include <random>

#include "engine/base/checked_number.h"

namespace limber::server {
namespace {

constexpr std::uint64_t kIdsPerRun = 1'000'000;
// Runs are numbered by 31 random bits with the 32nd set: ids have 16 digits and are below 2^52.
constexpr std::uint64_t kFirstRun = 1ull << 31, kEndOfRuns = 1ull << 32;
constexpr std::size_t kUidDigits = 16;

}  // namespace

Run Run::begin() {
  std::random_device random;  // of the operating system
  const std::uint64_t run = kFirstRun | (random() & (kFirstRun - 1));
  return {fmt::format("{:08x}{:08x}", run, static_cast<std::uint32_t>(random())), run * kIdsPerRun};
}

bool RunIds::is_of_another_run(std::uint64_t id) const {
  if (id > first_ && id <= last_.load()) return false;
  return id >= kFirstRun * kIdsPerRun && id < kEndOfRuns * kIdsPerRun;
}

std::string SessionKey::reference() const { return fmt::format("{}@{}", name, uid); }

SessionKey SessionKey::parse(const std::string& text) {
  const auto at = text.find('@');
  SessionKey key{text.substr(0, at), 0};
  if (at == std::string::npos) return key;
  // Each session has one reference: with leading zeros it would have more, of any length.
  const std::size_t digits = text.size() - at - 1;
  const bool is_written_so = digits > 0 && digits <= kUidDigits && text[at + 1] != '0';
  const auto uid = parse_number<std::uint64_t>(std::string_view(text).substr(at + 1));
  if (!is_written_so || !uid)
    throw invalid("session",
                  "a session is given as NAME or NAME@UID, its uid being a number > 0 of at most "
                  "16 digits without leading zeros");
  key.uid = *uid;
  return key;
}

Refusal restarted(const std::string& field, const std::string& what) {
  return {proto::ERROR_CODE_RESTARTED, field,
          what.empty() ? "the server was restarted: sessions and jobs of before are gone"
                       : fmt::format("{} is of another run of the server: it was restarted, and "
                                     "sessions and jobs of before are gone",
                                     what)};
}

}  // namespace limber::server
