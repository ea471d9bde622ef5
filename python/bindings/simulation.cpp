// Runs: stepped, commanded, saved, restored, forked and recorded from Python.
#include "pointflight/sim/simulation.hpp"

#include <pybind11/stl.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "pointflight/run/run_loop.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/run_summary.hpp"
#include "pointflight/sim/start_check.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/link.hpp"
#include "python/bindings/map_object.hpp"
#include "python/bindings/rays.hpp"
#include "python/bindings/run_objects.hpp"
#include "python/bindings/work.hpp"

namespace pointflight::python {
namespace {

constexpr std::size_t kEvery = 64;  // steps from one look for Ctrl-C to the next

/// Of a run and its forks: states of one fit the others.
struct Family {};

/// A state and whose it is.
struct StateObject {
  SimulationState state;
  std::shared_ptr<const Family> family;
};

/// Keeps the samples of some kinds: bits by their number in `Sample`.
class Collector : public SampleSink {
 public:
  explicit Collector(std::uint32_t kinds) : kinds_(kinds) {}
  void on_sample(const Sample& sample) override {
    if ((kinds_ >> sample.index() & 1u) != 0) samples_.push_back(sample);
  }
  /// As objects, in the order in which they came.
  [[nodiscard]] py::list take() {
    py::list list(samples_.size());
    for (std::size_t i = 0; i < samples_.size(); ++i) list[i] = object_of(std::move(samples_[i]));
    return list;
  }

 private:
  std::uint32_t kinds_;
  std::vector<Sample> samples_;
};

/// The files of a run beside its other links.
class RecorderLink : public Link {
 public:
  explicit RecorderLink(FlightRecorder& recorder) : recorder_(recorder) {}
  void on_sample(const Sample& sample) override { recorder_.on_sample(sample); }

 private:
  FlightRecorder& recorder_;
};

/// A run as Python holds it. Calls from two threads at once are refused, since a step lets go of
/// the interpreter's lock.
class SimulationObject {
 public:
  SimulationObject(const Scenario& scenario, std::shared_ptr<const SurfelMap> map)
      : executor_(executor()),
        simulation_(scenario, std::move(map), *executor_),
        family_(std::make_shared<const Family>()) {}
  SimulationObject(const SimulationObject& other, const Simulation& copy)
      : executor_(other.executor_), simulation_(copy), family_(other.family_) {}

  /// Steps until the run has come to `until` (ns) or has ended; at least one.
  py::list advance(std::int64_t until, std::uint32_t kinds) {
    const InUse guard(*this);
    require_sound();
    Collector collector(kinds);
    SampleSplitter sink;
    sink.add(collector);
    if (recorder_) sink.add(*recorder_);
    {
      const py::gil_scoped_release unlocked;
      std::size_t steps = 0;
      do {
        if (++steps % kEvery == 0) check_signals();
        failed_ = true;  // unless the step comes to its end
        const bool goes_on = simulation_.step(sink);
        failed_ = false;
        if (!goes_on) break;
      } while (simulation_.time() < SimTime(Duration(until)));
    }
    return collector.take();
  }

  /// To its end, with links that are given as (object, kinds, kinds that ask).
  void run(const std::vector<std::tuple<py::object, std::uint32_t, std::uint32_t>>& links,
           double rate,
           double lockstep) {
    const InUse guard(*this);
    require_sound();
    std::vector<std::unique_ptr<Link>> parties;
    for (const auto& [link, kinds, asked] : links) {
      parties.push_back(std::make_unique<PythonLink>(link, kinds, asked));
    }
    if (recorder_) parties.push_back(std::make_unique<RecorderLink>(*recorder_));
    RunOptions options;
    options.rate = rate;
    options.lockstep = lockstep;
    options.interrupted = [] {
      check_signals();
      return false;
    };
    const py::gil_scoped_release unlocked;
    RunLoop loop(simulation_, options);
    for (const auto& party : parties) loop.add(*party);
    failed_ = true;  // unless it comes to its end
    loop.run();
    failed_ = false;
  }

  std::optional<std::string> command(std::size_t vehicle, const Command& command) {
    const InUse guard(*this);
    return simulation_.command(vehicle, command);
  }

  [[nodiscard]] StateObject state() {
    const InUse guard(*this);
    require_sound();
    return {simulation_.state(), family_};
  }

  void restore(const StateObject& state) {
    const InUse guard(*this);
    if (state.family != family_) {
      throw py::value_error("state: of another simulation; those of a fork fit too");
    }
    if (recorder_)
      throw py::value_error("restore: the run is being recorded, and time goes on in files");
    simulation_.restore(state.state);
    failed_ = false;
  }

  [[nodiscard]] std::shared_ptr<SimulationObject> fork() {
    const InUse guard(*this);
    require_sound();
    return std::make_shared<SimulationObject>(*this, simulation_);
  }

  void record(const std::string& folder, bool replace) {
    const InUse guard(*this);
    if (recorder_) throw py::value_error("record: it is being recorded already");
    if (simulation_.state().step_number > 0) {
      throw py::value_error("record: a run is recorded from its first step on");
    }
    recorder_ = std::make_unique<FlightRecorder>(
        folder, simulation_, replace ? Existing::kReplace : Existing::kRefuse);
  }

  /// Without `keep` nothing is left of the recording.
  void end_recording(bool keep) {
    const InUse guard(*this);
    if (!recorder_) throw py::value_error("end_recording: nothing is being recorded");
    const std::unique_ptr<FlightRecorder> recorder = std::move(recorder_);
    if (!keep) return;
    require_sound();
    if (simulation_.end() == RunEnd::kRunning) simulation_.complete();
    recorder->finish(simulation_);
  }

  [[nodiscard]] py::tuple raycast(const Array<double>& origins,
                                  const Array<double>& directions,
                                  double range_max) {
    const InUse guard(*this);
    if (!beams_) beams_ = make_renderer("beam", Scene{simulation_.shared_map()});
    return hits_in(simulation_.map(),
                   *beams_,
                   origins,
                   directions,
                   range_max,
                   simulation_.bodies(),
                   simulation_.time());
  }

  template <class Function>
  auto read(const Function& function) {
    const InUse guard(*this);
    return function(std::as_const(simulation_));
  }
  void interrupt() {
    const InUse guard(*this);
    simulation_.interrupt();
  }

 private:
  /// For as long as one call takes.
  class InUse {
   public:
    explicit InUse(SimulationObject& object) : busy_(object.busy_) {
      if (busy_.exchange(true)) {
        throw std::runtime_error(
            "the simulation is in use by another thread, or by a callback of its own");
      }
    }
    ~InUse() { busy_ = false; }
    InUse(const InUse&) = delete;
    InUse& operator=(const InUse&) = delete;

   private:
    std::atomic<bool>& busy_;
  };

  void require_sound() const {
    if (failed_) throw std::runtime_error("a step of this simulation has failed; restore a state");
  }
  static void check_signals() {
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }

  std::shared_ptr<const Executor> executor_;
  Simulation simulation_;
  std::shared_ptr<const Family> family_;
  std::unique_ptr<FlightRecorder> recorder_;
  std::unique_ptr<const Renderer> beams_;  ///< Made for the first `raycast`.
  std::atomic<bool> busy_ = false;
  bool failed_ = false;
};

std::shared_ptr<SimulationObject> make_simulation(const Scenario& scenario,
                                                  const std::shared_ptr<MapObject>& map) {
  require_own_autopilots(scenario);
  const py::gil_scoped_release unlocked;
  return std::make_shared<SimulationObject>(scenario,
                                            map == nullptr ? scenario.open_map() : map->map);
}

py::list sensors_of(SimulationObject& object, std::size_t vehicle) {
  return object.read([&](const Simulation& s) {
    py::list kinds;
    for (const MountedSensor& sensor : s.vehicle(vehicle).sensors()) {
      kinds.append(sensor.kind != nullptr ? py::object(py::str(sensor.kind->name)) : py::none());
    }
    return kinds;
  });
}

}  // namespace

void add_simulation(py::module_& module) {
  using Object = SimulationObject;
  py::class_<StateObject>(module, "_State");
  py::class_<Object, std::shared_ptr<Object>>(module, "_Simulation")
      .def(py::init(&make_simulation), py::arg("scenario"), py::arg("map"))
      .def("advance", &Object::advance, py::arg("until"), py::arg("kinds"))
      .def("run", &Object::run, py::arg("links"), py::arg("rate"), py::arg("lockstep"))
      .def("command", &Object::command, py::arg("vehicle"), py::arg("command"))
      .def("state", &Object::state)
      .def("restore", &Object::restore, py::arg("state"))
      .def("fork", &Object::fork)
      .def("record", &Object::record, py::arg("folder"), py::arg("replace"))
      .def("end_recording", &Object::end_recording, py::arg("keep"))
      .def("interrupt", &Object::interrupt)
      .def("raycast",
           &Object::raycast,
           py::arg("origins"),
           py::arg("directions"),
           py::arg("range_max"))
      .def_property_readonly(
          "time_ns",
          [](Object& o) {
            return o.read([](const Simulation& s) { return s.time().time_since_epoch().count(); });
          })
      .def_property_readonly(
          "end",
          [](Object& o) {
            return o.read([](const Simulation& s) { return std::string(to_string(s.end())); });
          })
      .def_property_readonly(
          "is_running",
          [](Object& o) {
            return o.read([](const Simulation& s) { return s.end() == RunEnd::kRunning; });
          })
      .def_property_readonly(
          "summary",
          [](Object& o) { return o.read([](const Simulation& s) { return summary_json(s); }); })
      .def("sensors", &sensors_of, py::arg("vehicle"))
      .def(
          "status",
          [](Object& o, std::size_t vehicle) {
            return o.read([&](const Simulation& s) { return s.status_sample(vehicle); });
          },
          py::arg("vehicle"));
}

}  // namespace pointflight::python
