#pragma once

namespace limber {

/// One of a bounded number of places, held by a thread that runs tasks of many owners.
class PlaceOfTask {
 public:
  PlaceOfTask() = default;
  PlaceOfTask(const PlaceOfTask&) = delete;
  PlaceOfTask& operator=(const PlaceOfTask&) = delete;
  virtual ~PlaceOfTask() = default;

  /// Others may have the place, and a thread of their own.
  virtual void lend() = 0;
  /// At once, whoever has it.
  virtual void take_back() = 0;
};

/// While one exists, the calling thread runs a task in that place.
class InPlace {
 public:
  explicit InPlace(PlaceOfTask& place);
  InPlace(const InPlace&) = delete;
  InPlace& operator=(const InPlace&) = delete;
  ~InPlace();

 private:
  PlaceOfTask* const before_;
};

/// While one exists, the calling thread's task waits for somebody, maybe for hours: its place is
/// lent. No effect on threads without one.
class LentPlace {
 public:
  LentPlace();
  LentPlace(const LentPlace&) = delete;
  LentPlace& operator=(const LentPlace&) = delete;
  ~LentPlace();

 private:
  PlaceOfTask* const place_;
};

}  // namespace limber
