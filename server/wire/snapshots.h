#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "engine/base/checked_number.h"
#include "engine/session/core/snapshot_history.h"
#include "limber/v1/stored.pb.h"
#include "server/wire/difference.h"
#include "server/wire/errors.h"
#include "server/wire/wire_check.h"

namespace limber::server {

/// That serialised snapshots of one checkpoint have together at most.
inline constexpr std::size_t kMostSnapshotBytes = std::size_t{1} << 30u;

inline void encode_step(const session::StepNote& note, proto::StoredStep& message) {
  message.set_author(note.author);
  message.set_number(note.number);
  message.set_takes_back(note.takes_back);
}

inline session::StepNote decode_step(const proto::StoredStep& message) {
  return {message.author(), message.number(), message.takes_back()};
}

/// The history of a document whose steps are whole values.
/// @param encode  a value as its message
template <class Parts, class Encode>
[[nodiscard]] proto::StoredSnapshots encode_snapshots(const Parts& parts, const Encode& encode) {
  proto::StoredSnapshots message;
  std::string before;
  const auto add = [&](const auto& snapshot, const session::StepNote* note) {
    std::string bytes = encode(*snapshot).SerializeAsString();
    auto& added = *message.add_snapshots();
    added.set_difference(difference_of(before, bytes));
    if (note != nullptr) encode_step(*note, *added.mutable_step());
    before = std::move(bytes);
  };
  // Notes of undo are of the step behind their value, those of redo of the step to it.
  for (std::size_t i = 0; i < parts.undo.size(); ++i)
    add(parts.undo[i], i == 0 ? nullptr : &parts.undo_notes[i - 1]);
  add(parts.now, parts.undo.empty() ? nullptr : &parts.undo_notes.back());
  for (std::size_t i = parts.redo.size(); i > 0; --i)
    add(parts.redo[i - 1], &parts.redo_notes[i - 1]);
  message.set_undo_count(static_cast<std::uint32_t>(parts.undo.size()));
  message.set_last_number(parts.last_number);
  return message;
}

/// @tparam Message  that a snapshot is
/// @param decode  a message as a value
/// @throws Refusal MALFORMED where a snapshot is none; as `decode`
template <class Message, class Parts, class Decode>
[[nodiscard]] Parts decode_snapshots(const proto::StoredSnapshots& message, const Decode& decode) {
  const int undo = to_whole<int>(message.undo_count()).value_or(message.snapshots_size());
  if (undo >= message.snapshots_size())
    throw malformed("a checkpoint has fewer snapshots than steps of undo");
  Parts parts;
  parts.last_number = message.last_number();
  std::string bytes;
  std::size_t left = kMostSnapshotBytes;
  for (int i = 0; i < message.snapshots_size(); ++i) {
    const proto::StoredSnapshot& stored = message.snapshots(i);
    bytes = with_difference(bytes, stored.difference(), left);
    left -= bytes.size();
    check_wire(bytes, *Message::descriptor());
    Message snapshot;
    if (!snapshot.ParseFromString(bytes)) throw malformed("a snapshot is no message");
    auto value = std::make_shared<typename Parts::Value>(decode(snapshot));
    if (i < undo) {
      parts.undo.push_back(std::move(value));
    } else if (i == undo) {
      parts.now = std::move(value);
    } else {
      parts.redo.push_front(std::move(value));
    }
    if (i == 0) continue;
    if (i <= undo) {
      parts.undo_notes.push_back(decode_step(stored.step()));
    } else {
      parts.redo_notes.push_front(decode_step(stored.step()));
    }
  }
  return parts;
}

}  // namespace limber::server
