#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/runtime/record.h"
#include "server/wire/paths.h"

namespace limber::server {

/// The context for reading a scene, besides its message.
struct SceneContext {
  PathResolver resolve;  // of files that a scene names
  ServiceLimits limits;
};

/// A scene that was read and is sound: a session can be made of it, in two steps, since the record
/// must be there before the session reports to it.
class Opening {
 public:
  Opening() = default;
  virtual ~Opening() = default;
  Opening(const Opening&) = delete;
  Opening& operator=(const Opening&) = delete;

  /// How large it is, for the log: "12 nodes, 3 tets".
  [[nodiscard]] virtual std::string size() const = 0;
  [[nodiscard]] virtual SessionMemory memory() const = 0;
  /// Warnings, with fields of the request.
  [[nodiscard]] virtual std::vector<proto::Issue> remarks() const { return {}; }
  /// The record, without a session. Once.
  [[nodiscard]] virtual std::shared_ptr<Record> make_record(Hub& hub, const SessionKey& key,
                                                            JobId open_job) = 0;
  /// Makes the session of that record; `executor` runs its tasks. Once, after make_record().
  /// @throws Error with fields of the request
  virtual void start(Hub& hub, session::Executor executor) = 0;
};

/// The kind of a session: elastic bodies, rod linkages, structures of beams. An object of this
/// class is what the service knows of a kind; everything else of the kind is in its own folder.
/// Called from any thread.
class Kind {
 public:
  Kind() = default;
  virtual ~Kind() = default;
  Kind(const Kind&) = delete;
  Kind& operator=(const Kind&) = delete;

  /// Short and unique: "beams".
  [[nodiscard]] virtual const char* name() const = 0;
  /// Whether this kind reads the scene; whether it is sound is found when it is read. If several
  /// kinds would read it, the first in the registry does.
  [[nodiscard]] virtual bool accepts(const proto::Scene& scene) const = 0;
  /// @throws Refusal or Error naming fields below "scene."
  [[nodiscard]] virtual std::unique_ptr<Opening> read(const proto::Scene& scene,
                                                      const SceneContext& context) const = 0;
  /// All that is wrong with a scene: the first error is the one that read() refuses it with.
  /// @param prefix  of fields, "scene." or empty
  [[nodiscard]] virtual std::vector<proto::Issue> validate(const proto::Scene& scene,
                                                           const std::string& prefix,
                                                           const SceneContext& context) const = 0;

  /// The defaults for members that a scene omits, as far as builds differ in them. Stored with the
  /// scene.
  [[nodiscard]] virtual proto::Scene defaults_of(const proto::Scene& /*scene*/) const { return {}; }
  /// Writes into a stored scene what builds before defaults_of() took where it says nothing.
  virtual void add_older_defaults(proto::Scene& /*scene*/) const {}
  /// Has a scene begin where an answer was: what Record::add_start() had put into `start`.
  virtual void begin_in(proto::Scene& /*scene*/, const proto::Scene& /*start*/) const {}

  /// Scenes of limber's own, by name.
  [[nodiscard]] virtual std::vector<std::string> sample_names() const { return {}; }
  /// @param name  one of these
  [[nodiscard]] virtual proto::Scene sample(const std::string& name) const;

  /// Whether an edit of this kind takes long to read, whatever its size (such as one that reads a
  /// file): requests with such edits are for the pool.
  [[nodiscard]] virtual bool is_heavy(const proto::Edit&) const { return false; }
  /// Whether an edit of this kind may be megabytes (such as poses): requests with such edits may be
  /// as large as any.
  [[nodiscard]] virtual bool may_be_large(const proto::Edit&) const { return false; }

  /// Requests without a session that this kind alone has (such as simulate, solve_beams).
  /// @returns false where it has no such request
  [[nodiscard]] virtual bool answer(const proto::Request&, proto::Reply&, Hub&,
                                    const SceneContext&) const {
    return false;
  }
};

/// The kinds that a server has, in order.
class Kinds {
 public:
  Kinds& add(std::unique_ptr<const Kind> kind);
  /// @param field  of the scene in the request, for the refusal
  /// @throws Refusal UNSUPPORTED where no kind accepts the scene
  [[nodiscard]] const Kind& of(const proto::Scene& scene, const std::string& field) const;
  [[nodiscard]] std::vector<std::string> sample_names() const;
  /// @throws Error{kNotFound, "name"} where no kind has it
  [[nodiscard]] proto::Scene sample(const std::string& name) const;
  /// Whether the request has an edit that some kind calls heavy.
  [[nodiscard]] bool are_heavy(const proto::EditRequest& request) const;
  /// Whether the request has an edit that may be large.
  [[nodiscard]] bool may_be_large(const proto::EditRequest& request) const;
  /// @returns whether some kind has such a request
  [[nodiscard]] bool answer(const proto::Request& request, proto::Reply& reply, Hub& hub,
                            const SceneContext& context) const;

 private:
  /// Whether some kind says `what` of some edit of the request.
  [[nodiscard]] bool any_edit(const proto::EditRequest& request,
                              bool (Kind::*what)(const proto::Edit&) const) const;

  std::vector<std::unique_ptr<const Kind>> kinds_;
};

}  // namespace limber::server
