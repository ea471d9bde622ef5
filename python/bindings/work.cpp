#include "python/bindings/work.hpp"

#include <mutex>
#include <string>

namespace pointflight::python {
namespace {

namespace py = pybind11;

struct Shared {
  std::mutex mutex;
  std::shared_ptr<const Executor> executor;
};

Shared& shared() {
  // never destroyed: threads may still run when the interpreter ends
  static auto* const all = new Shared;
  return *all;
}

}  // namespace

std::shared_ptr<const Executor> executor() {
  Shared& all = shared();
  const std::lock_guard lock(all.mutex);
  if (all.executor == nullptr) all.executor = std::make_shared<const Executor>(0);
  return all.executor;
}

void set_threads(int threads) {
  if (threads < 0 || threads > 1024) {
    throw py::value_error("threads: 0 (all cores) to 1024, not " + std::to_string(threads));
  }
  Shared& all = shared();
  const std::lock_guard lock(all.mutex);
  all.executor.reset();  // oneTBB goes by the least of the limits that there are
  all.executor = std::make_shared<const Executor>(threads);
}

std::shared_ptr<py::object> held(const py::object& object) {
  return {new py::object(object), [](py::object* one) {
            if (Py_IsInitialized() == 0) return;  // what is left at the end stays
            const py::gil_scoped_acquire lock;
            delete one;
          }};
}

Progress interruptible(const py::object& callable) {
  return [callable = held(callable)](std::string_view what, double share) {
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!callable->is_none()) (*callable)(std::string(what), share);
  };
}

}  // namespace pointflight::python
