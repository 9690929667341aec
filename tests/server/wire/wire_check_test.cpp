#include "server/wire/wire_check.h"

#include <gmock/gmock.h>

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "tests/server/support/client.h"
#include "tests/server/support/scenes.h"

namespace limber::server {
namespace {

using ::testing::HasSubstr;
using namespace limber::server::testing;

const google::protobuf::Descriptor& request_type() { return *proto::Request::descriptor(); }

Refusal refusal_of(const std::string& bytes, WireBudget budget = {}) {
  try {
    check_wire(bytes, request_type(), budget);
  } catch (const Refusal& refusal) {
    return refusal;
  }
  ADD_FAILURE() << "was accepted";
  return invalid("", "");
}

proto::Request edit_with_two() {
  proto::Request request = move_request("a", 1, 1, 2, 3);
  auto* constraint = request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
  constraint->mutable_position()->set_x(1);
  constraint->add_axes(proto::AXIS_X);
  constraint->add_axes(proto::AXIS_Z);
  return request;
}

TEST(WireCheck, AcceptsWhatProtobufWrites) {
  EXPECT_NO_THROW(check_wire(edit_with_two().SerializeAsString(), request_type()));
  EXPECT_NO_THROW(check_wire(open_request(small_scene()).SerializeAsString(), request_type()));
  EXPECT_NO_THROW(check_wire("", request_type()));
}

TEST(WireCheck, UnknownFieldsAreNamedByTheMessageTheyAreIn) {
  proto::Request request = edit_with_two();
  auto* constraint = request.mutable_edit()->mutable_edits(1)->mutable_add()->mutable_constraint();
  constraint->GetReflection()->MutableUnknownFields(constraint)->AddVarint(77, 1);
  const Refusal refusal = refusal_of(request.SerializeAsString());
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_EQ(refusal.field(), "edits[1].add.constraint");
  EXPECT_THAT(refusal.what(), HasSubstr("unknown field number 77 in Constraint"));
}

TEST(WireCheck, UnknownFieldsOfTheOutermostMessage) {
  proto::Request request = info_request();
  request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(4000, "x");
  EXPECT_THAT(refusal_of(request.SerializeAsString()).what(),
              HasSubstr("unknown field number 4000 in Request"));
}

TEST(WireCheck, NumbersThatAreNotFinite) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    const Refusal refusal = refusal_of(move_request("a", 1, 0, bad, 0).SerializeAsString());
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
    EXPECT_EQ(refusal.field(), "edits[0].move.target.y");
  }
}

TEST(WireCheck, NumbersThatTheirFieldCannotHold) {
  // protobuf would read 2^32 as 0.
  for (const std::uint64_t value : {1ull << 32, (1ull << 32) + 7, ~0ull}) {
    proto::Request request;
    auto* add = request.mutable_edit()->add_edits()->mutable_hold_beam_node();
    add->GetReflection()->MutableUnknownFields(add)->AddVarint(1, value);
    const Refusal refusal = refusal_of(request.SerializeAsString());
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
    EXPECT_EQ(refusal.field(), "edits[0].hold_beam_node.node");
    EXPECT_THAT(refusal.what(), HasSubstr(std::to_string(value) + " does not fit 32 bits"));
  }
  proto::Request request;
  auto* given = request.mutable_edit()->add_edits()->mutable_hold_beam_node();
  given->set_node(std::numeric_limits<std::uint32_t>::max());
  EXPECT_NO_THROW(check_wire(request.SerializeAsString(), request_type()));
}

TEST(WireCheck, EnumValuesBeyond32Bits) {
  proto::Request request = edit_with_two();
  auto* constraint = request.mutable_edit()->mutable_edits(1)->mutable_add()->mutable_constraint();
  constraint->clear_axes();
  constraint->GetReflection()
      ->MutableUnknownFields(constraint)
      ->AddVarint(proto::Constraint::kAxesFieldNumber, (1ull << 32) + 1);
  EXPECT_THAT(refusal_of(request.SerializeAsString()).what(),
              HasSubstr("4294967297 is no value of Axis"));
}

TEST(WireCheck, TextsWithZeroBytes) {
  proto::Request request = open_request(small_scene());
  auto& file = *request.mutable_open_session()->mutable_scene()->mutable_mesh()->mutable_file();
  file.set_name(std::string("a\0.msh", 6));
  file.set_content(std::string(3, '\0'));  // bytes may have them
  EXPECT_EQ(refusal_of(request.SerializeAsString()).field(), "scene.mesh.file.name");
  file.set_name("a.msh");
  EXPECT_NO_THROW(check_wire(request.SerializeAsString(), request_type()));
  (*file.mutable_companions())[std::string("\0", 1)] = "bytes";
  EXPECT_THAT(refusal_of(request.SerializeAsString()).field(), HasSubstr("companions"));
}

TEST(WireCheck, EnumValuesNobodyDefined) {
  proto::Request request = edit_with_two();
  request.mutable_edit()->mutable_edits(1)->mutable_add()->mutable_constraint()->set_axes(
      1, static_cast<proto::Axis>(9));
  Refusal refusal = refusal_of(request.SerializeAsString());
  EXPECT_EQ(refusal.field(), "edits[1].add.constraint.axes[1]");
  EXPECT_THAT(refusal.what(), HasSubstr("9 is no value of Axis"));
  request = wait_request("a", 1);
  request.mutable_wait()->set_until(static_cast<proto::WaitRequest::Until>(-3));
  refusal = refusal_of(request.SerializeAsString());
  EXPECT_EQ(refusal.field(), "until");
}

TEST(WireCheck, SingularFieldsGivenTwice) {
  const std::string once = info_request().SerializeAsString();
  EXPECT_THAT(refusal_of(once + once).what(), HasSubstr("given twice"));
  const std::string other = wait_request("a", 1).SerializeAsString();
  EXPECT_EQ(refusal_of(once + other).field(), "wait");
  EXPECT_THAT(refusal_of(once + other).what(),
              HasSubstr("given beside get_server_info, only one of body"));
}

TEST(WireCheck, WrongWireTypes) {
  // Request.version (1) as length-delimited, Request.edit (15) as a varint.
  EXPECT_EQ(refusal_of(std::string("\x0a\x01x", 3)).field(), "version");
  EXPECT_EQ(refusal_of(std::string("\x78\x01", 2)).field(), "edit");
}

TEST(WireCheck, EveryTruncationIsRefused) {
  const std::string bytes = edit_with_two().SerializeAsString();
  // Cut at field boundaries of the outermost message, what is left is a message; nowhere else.
  int accepted = 0;
  for (std::size_t length = 1; length < bytes.size(); ++length) {
    try {
      check_wire(bytes.substr(0, length), request_type());
      ++accepted;
    } catch (const Refusal& refusal) {
      EXPECT_EQ(refusal.code(), proto::ERROR_CODE_MALFORMED) << length;
    }
  }
  EXPECT_EQ(accepted, 0);  // there is one field only
}

TEST(WireCheck, LengthsBeyondTheEndAndBeyondTheParent) {
  EXPECT_EQ(refusal_of(std::string("\x7a\xff\xff\xff\xff\x07", 6)).code(),
            proto::ERROR_CODE_MALFORMED);
  EXPECT_EQ(refusal_of(std::string("\x7a\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01", 11)).code(),
            proto::ERROR_CODE_MALFORMED);
  // edit { session: length 5 of which 1 is inside } and four more bytes after the parent.
  EXPECT_EQ(refusal_of(std::string("\x7a\x03\x0a\x05x\x08\x01\x08\x01", 9)).code(),
            proto::ERROR_CODE_MALFORMED);
}

TEST(WireCheck, SubmessagesAreCountedBeforeTheyAreBuilt) {
  proto::Request request;
  for (int i = 0; i < 1000; ++i) request.mutable_edit()->add_edits();
  const Refusal refusal = refusal_of(request.SerializeAsString(), {500});
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(refusal.details().at("limit"), "500");
}

/// A message of a kind of its own: many fields, and a group.
class OtherMessage {
 public:
  explicit OtherMessage(int fields) {
    google::protobuf::FileDescriptorProto file;
    file.set_name("other.proto");
    auto& type = *file.add_message_type();
    type.set_name("Other");
    const auto add = [&](const std::string& name, int number, auto kind, auto label) {
      auto& field = *type.add_field();
      field.set_name(name);
      field.set_number(number);
      field.set_type(kind);
      field.set_label(label);
      return &field;
    };
    using Field = google::protobuf::FieldDescriptorProto;
    for (int i = 1; i <= fields; ++i)
      add("f" + std::to_string(i), i, Field::TYPE_DOUBLE, Field::LABEL_OPTIONAL);
    add("inner", 2000, Field::TYPE_MESSAGE, Field::LABEL_REPEATED)->set_type_name(".Other");
    type.add_nested_type()->set_name("G");
    add("g", 2001, Field::TYPE_GROUP, Field::LABEL_OPTIONAL)->set_type_name(".Other.G");
    type_ = pool_.BuildFile(file)->message_type(0);
  }
  [[nodiscard]] const google::protobuf::Descriptor& type() const { return *type_; }
  [[nodiscard]] std::unique_ptr<google::protobuf::Message> make() {
    return std::unique_ptr<google::protobuf::Message>(factory_.GetPrototype(type_)->New());
  }
  [[nodiscard]] const google::protobuf::FieldDescriptor* field(const std::string& name) const {
    return type_->FindFieldByName(name);
  }

 private:
  google::protobuf::DescriptorPool pool_;
  google::protobuf::DynamicMessageFactory factory_;
  const google::protobuf::Descriptor* type_;
};

Refusal refusal_of(const OtherMessage& other, const std::string& bytes) {
  try {
    check_wire(bytes, other.type());
  } catch (const Refusal& refusal) {
    return refusal;
  }
  ADD_FAILURE() << "was accepted";
  return invalid("", "");
}

TEST(WireCheck, MessagesOfManyFieldsAreCheckedAsOthers) {
  OtherMessage other(1000);
  const auto message = other.make();
  const auto& reflection = *message->GetReflection();
  reflection.SetDouble(message.get(), other.field("f1000"), 3);
  reflection.SetDouble(reflection.AddMessage(message.get(), other.field("inner")),
                       other.field("f999"), 4);
  const std::string bytes = message->SerializeAsString();
  EXPECT_NO_THROW(check_wire(bytes, other.type()));
  EXPECT_THAT(refusal_of(other, bytes + bytes).what(), HasSubstr("given twice"));
  EXPECT_EQ(refusal_of(other, bytes + bytes).field(), "f1000");
  reflection.SetDouble(reflection.MutableRepeatedMessage(message.get(), other.field("inner"), 0),
                       other.field("f1000"), std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(refusal_of(other, message->SerializeAsString()).field(), "inner[0].f1000");
}

TEST(WireCheck, GroupsOfOtherMessagesAreRefused) {
  OtherMessage other(1);
  const auto message = other.make();
  message->GetReflection()->MutableMessage(message.get(), other.field("g"));
  EXPECT_EQ(refusal_of(other, message->SerializeAsString()).field(), "g");
}

TEST(WireCheck, ABudgetIsOfAllThatItIsGivenTo) {
  proto::Request request;
  for (int i = 0; i < 10; ++i) request.mutable_edit()->add_edits();
  const std::string bytes = request.SerializeAsString();
  WireBudget budget{25};
  EXPECT_NO_THROW(check_wire(bytes, request_type(), budget));
  EXPECT_NO_THROW(check_wire(bytes, request_type(), budget));
  EXPECT_EQ(budget.spent, 22u);
  EXPECT_THROW(check_wire(bytes, request_type(), budget), Refusal);
}

TEST(WireCheck, GroupsAndFieldZeroAreMalformedOrUnknown) {
  for (const char* bytes : {"\x7b\x7c", "\x7c", "\x03", "\x00\x01"}) {
    EXPECT_THROW(check_wire(std::string(bytes, 2), request_type()), Refusal);
  }
  // One that never ends, behind the envelope.
  const std::string group = std::string("\x08\x01\x10\x05", 4) + std::string(1000, '\x3b');
  EXPECT_THAT(refusal_of(group).what(), HasSubstr("unknown field number 7"));
}

}  // namespace
}  // namespace limber::server
