#include "engine/base/lent_place.h"

#include <utility>

namespace limber {
namespace {

thread_local PlaceOfTask* place_of_this_thread = nullptr;

}  // namespace

InPlace::InPlace(PlaceOfTask& place) : before_(std::exchange(place_of_this_thread, &place)) {}

InPlace::~InPlace() { place_of_this_thread = before_; }

LentPlace::LentPlace() : place_(place_of_this_thread) {
  if (place_ != nullptr) place_->lend();
}

LentPlace::~LentPlace() {
  if (place_ != nullptr) place_->take_back();
}

}  // namespace limber
