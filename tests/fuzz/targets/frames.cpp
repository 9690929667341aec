// What the server encodes, as clients and the journal decode it. The first byte chooses:
//   f  a message of frames, "\n%%%\n", geometry: the positions that the C++ client makes of them
//   m  messages of frames, separated so: the first is a whole motion, the others its changes
//   q  a byte for the nodes of a frame, numbers: quantised by the server, decoded by the client
//   d  bytes, "\n%%%\n", others: written to the journal as a difference, and read again
//   x  bytes, "\n%%%\n", a difference that is none
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "clients/cpp/error.h"
#include "clients/cpp/frames.h"
#include "clients/cpp/motion_buffer.h"
#include "server/wire/difference.h"
#include "server/wire/frames.h"
#include "tests/fuzz/decoding.h"
#include "tests/fuzz/input.h"

namespace {

using namespace limber;
namespace proto = limber::v1;

constexpr std::string_view kSeparator = "\n%%%\n";
// A client takes motions as long as its server says; here there is no room for all of them.
constexpr std::uint64_t kMostNumbers = 1 << 20;

template <class Message>
Message message_of(std::string_view bytes) {
  Message message;  // as far as it can be read
  (void)message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  return message;
}

/// As fuzz::reads(), of the client.
template <class Read>
bool client_reads(const Read& read) {
  try {
    read();
    return true;
  } catch (const client::ClientError& error) {
    if (*error.what() == '\0') fuzz::finding("an error without a message");
  } catch (const std::exception& fault) {
    fuzz::finding(fault.what());
  }
  return false;
}

void decode_positions(std::string_view bytes) {
  const auto frames = message_of<proto::Frames>(fuzz::take_until(bytes, kSeparator));
  const auto geometry = message_of<proto::GetGeometryResponse>(bytes);
  client_reads([&] {
    const client::Positions positions = client::decode(frames, &geometry);
    if (positions.values.size() != 3 * positions.frames * positions.nodes)
      fuzz::finding("positions that are not frames x nodes x 3");
    if (client::npy(positions).size() % 4 != 0) fuzz::finding("numbers that begin within a word");
  });
}

bool has_room(const proto::Frames& frames) {
  std::uint64_t numbers = std::max(frames.frame_count(), frames.changes().motion_frames());
  for (int i = 1; i < frames.data().shape_size(); ++i) {
    const std::uint64_t extent = frames.data().shape(i);
    if (extent > kMostNumbers || (numbers *= extent) > kMostNumbers) return false;
  }
  return numbers <= kMostNumbers;
}

void follow_motion(std::string_view bytes) {
  client::MotionBuffer motion;
  for (int i = 0; !bytes.empty(); ++i) {
    const auto frames = message_of<proto::Frames>(fuzz::take_until(bytes, kSeparator));
    if (!has_room(frames)) return;
    client_reads([&] {
      if (i == 0) return motion.begin(frames);
      const std::uint64_t before = motion.sequence();
      const auto outcome = motion.put(frames);
      using Outcome = client::MotionBuffer::Outcome;
      if (outcome == Outcome::kWhole && motion.sequence() <= before)
        fuzz::finding("a newer motion has no newer number");
      if (outcome == Outcome::kIgnored && motion.sequence() != before)
        fuzz::finding("a message was ignored, but has changed the motion");
    });
    if (motion.coordinates().size() != motion.frame_count() * motion.size())
      fuzz::finding("a motion that is not frames x numbers");
  }
}

void quantise(std::string_view bytes) {
  if (bytes.empty()) return;
  const Eigen::Index rows = 3 * (1 + static_cast<unsigned char>(bytes.front()) % 8);
  bytes.remove_prefix(1);
  const Eigen::Index columns = static_cast<Eigen::Index>(bytes.size() / sizeof(float)) / rows;
  Eigen::MatrixXf numbers(rows, columns);
  if (numbers.size() > 0)
    std::memcpy(numbers.data(), bytes.data(),
                static_cast<std::size_t>(numbers.size()) * sizeof(float));
  // Lengths, in whatever unit: frames of others are not published.
  for (float& number : numbers.reshaped()) {
    if (!std::isfinite(number) || std::abs(number) > 1e15f) number = 1;
    if (std::abs(number) < 1e-15f) number = 0;
  }
  proto::Frames sent;
  sent.set_encoding(proto::ENCODING_POSITIONS_QUANTISED);
  server::set_positions(numbers, sent.encoding(), sent);
  const auto received = message_of<proto::Frames>(sent.SerializeAsString());
  const client::Positions positions = client::decode(received, nullptr);
  if (positions.values.size() != static_cast<std::size_t>(numbers.size()))
    fuzz::finding("other positions came than were sent");
  if (numbers.size() == 0) return;
  const double rounding = 1.2e-7 * static_cast<double>(numbers.cwiseAbs().maxCoeff());
  for (Eigen::Index i = 0; i < numbers.size(); ++i) {
    const double error =
        std::abs(static_cast<double>(numbers.data()[i]) -
                 static_cast<double>(positions.values[static_cast<std::size_t>(i)]));
    if (!(error <= received.quantisation_error() + rounding))
      fuzz::finding("a rounding error beyond the one that is said");
  }
}

void write_difference(std::string_view bytes) {
  const std::string_view before = fuzz::take_until(bytes, kSeparator);
  const std::string difference = server::difference_of(before, bytes);
  if (server::with_difference(before, difference, bytes.size()) != bytes)
    fuzz::finding("a difference leads to other bytes");
}

void read_difference(std::string_view bytes) {
  constexpr std::size_t kMost = 1 << 16;
  const std::string_view before = fuzz::take_until(bytes, kSeparator);
  fuzz::answers([&] {
    if (server::with_difference(before, bytes, kMost).size() > kMost)
      fuzz::finding("a difference leads to more bytes than may be");
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view bytes = fuzz::text_of(data, size);
  if (bytes.empty()) return 0;
  const char reader = bytes.front();
  bytes.remove_prefix(1);
  switch (reader) {
    case 'f':
      decode_positions(bytes);
      break;
    case 'm':
      follow_motion(bytes);
      break;
    case 'q':
      quantise(bytes);
      break;
    case 'd':
      fuzz::answers([&] { write_difference(bytes); });
      break;
    case 'x':
      read_difference(bytes);
      break;
    default:
      break;
  }
  return 0;
}
