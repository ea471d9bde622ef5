// Long work on behalf of Python: on how many threads, and how it is interrupted.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "pointflight/core/parallel.hpp"
#include "pointflight/core/progress.hpp"

namespace pointflight::python {

/// What all work of the module runs on; whoever holds it may go on while it is changed.
std::shared_ptr<const Executor> executor();

/// From now on work runs on so many threads; 0: all cores.
void set_threads(int threads);

/// An object that C++ keeps: its last copy may go away without the interpreter's lock, and even
/// after the interpreter.
std::shared_ptr<pybind11::object> held(const pybind11::object& object);

/// Lets Ctrl-C end long work, whose thread does not hold the interpreter's lock meanwhile, and
/// passes the progress on to a callable of (what, share) if it is not None. An exception of the
/// callable ends the work and comes out of it.
Progress interruptible(const pybind11::object& callable);

}  // namespace pointflight::python
