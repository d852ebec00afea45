// Loops as functions of Python: what they are given read, what they return made.
#pragma once
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#define NPY_NO_DEPRECATED_API NPY_1_23_API_VERSION
#define NPY_TARGET_VERSION NPY_1_23_API_VERSION
#ifndef CLEARWAY_MODULE
#define NO_IMPORT_ARRAY
#endif
#define PY_ARRAY_UNIQUE_SYMBOL clearway_numpy
#include <numpy/arrayobject.h>

#include "numbers.hpp"

// Once for each type, not for each loop.
#define RT_APART __attribute__((noinline))

namespace rt {

struct Mismatch : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// What a loop is called in Python; its parameters, in order, with a comma after each; of every array
// in them a letter, w for one that it writes to.
struct Loop {
  const char* name;
  const char* parameters;
  const char* arrays;
};

// One call: the arrays that it was given, and copies of those that were of another type.
class Call {
 public:
  // room: for as many as the loop takes.
  Call(const Loop& loop, PyArrayObject** room) : loop(loop), given_(room) {}
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
  RT_APART ~Call() {
    for (PyObject* copy : copies_) Py_DECREF(copy);
  }
  // Whether the loop writes to the array that is read next.
  bool writes() const { return loop.arrays[count_] == 'w'; }
  void note(PyArrayObject* array) { given_[count_++] = array; }
  void own(PyObject* copy) { copies_.push_back(copy); }
  // The array of this call in whose memory a place is.
  RT_APART PyArrayObject* holder_of(const void* place) const {
    const auto* p = static_cast<const char*>(place);
    for (std::size_t k = 0; k < count_; ++k) {
      const auto* start = static_cast<const char*>(PyArray_DATA(given_[k]));
      if (PyArray_IS_C_CONTIGUOUS(given_[k]) && p >= start && p < start + PyArray_NBYTES(given_[k]))
        return given_[k];
    }
    return nullptr;
  }
  const Loop& loop;
  const char* reading = "";
  std::size_t at = 0;

 private:
  PyArrayObject** given_;
  std::size_t count_ = 0;
  std::vector<PyObject*> copies_;
};
// While results are made: a collection could run another loop, whose temporaries lie where those
// of this one end.
struct NoCollection {
  const int was = PyGC_Disable();
  NoCollection() = default;
  NoCollection(const NoCollection&) = delete;
  NoCollection& operator=(const NoCollection&) = delete;
  ~NoCollection() {
    if (was) PyGC_Enable();
  }
};

template <class T>
struct Element;
#define RT_ELEMENT(T, number, label)          \
  template <>                                 \
  struct Element<T> {                         \
    static constexpr int type = number;       \
    static constexpr const char* name = label; \
  };
RT_ELEMENT(f64, NPY_FLOAT64, "float64")
RT_ELEMENT(i64, NPY_INT64, "int64")
RT_ELEMENT(i32, NPY_INT32, "int32")
RT_ELEMENT(i16, NPY_INT16, "int16")
RT_ELEMENT(i8, NPY_INT8, "int8")
RT_ELEMENT(u64, NPY_UINT64, "uint64")
RT_ELEMENT(u32, NPY_UINT32, "uint32")
RT_ELEMENT(u8, NPY_UINT8, "uint8")
RT_ELEMENT(bool, NPY_BOOL, "bool")

RT_APART inline std::string text_of(PyObject* object) {
  PyObject* text = PyObject_Str(object);
  const char* letters = text == nullptr ? nullptr : PyUnicode_AsUTF8AndSize(text, nullptr);
  std::string result = letters == nullptr ? "?" : letters;
  Py_XDECREF(text);
  PyErr_Clear();
  return result;
}
RT_APART inline std::string kind_of(PyObject* object) {
  if (!PyArray_Check(object)) {
    PyObject* type = PyObject_Type(object);
    PyObject* name = PyObject_GetAttrString(type, "__name__");
    std::string result = name == nullptr ? "?" : text_of(name);
    Py_XDECREF(name);
    Py_DECREF(type);
    return result;
  }
  auto* array = reinterpret_cast<PyArrayObject*>(object);
  return "an array of " + text_of(reinterpret_cast<PyObject*>(PyArray_DESCR(array))) + " with " +
         std::to_string(PyArray_NDIM(array)) + " dimensions";
}
[[noreturn]] RT_APART inline void mismatch(const std::string& wanted, PyObject* object) {
  PyErr_Clear();
  throw Mismatch("wants " + wanted + ", not " + kind_of(object));
}

RT_APART inline void check_tuple(PyObject* from, int count, const char* name) {
  if (!PyTuple_Check(from) || PyTuple_Size(from) != count)
    mismatch(std::string("a ") + name + " of " + std::to_string(count), from);
}
// A tuple, or one of a class that is one, with its items; takes over all of them.
RT_APART inline PyObject* filled(PyObject* tuple, PyObject** items, std::size_t count) {
  bool good = tuple != nullptr;
  for (std::size_t k = 0; k < count; ++k) {
    good = good && items[k] != nullptr;
    if (!good)
      Py_XDECREF(items[k]);
    else
      good = PyTuple_SetItem(tuple, static_cast<Py_ssize_t>(k), items[k]) == 0;
  }
  if (good) return tuple;
  Py_XDECREF(tuple);
  return nullptr;
}
// An instance of a named tuple, whose class is looked up once.
RT_APART inline PyObject* empty_record(PyTypeObject*& type, const char* module, const char* name,
                                       std::size_t count) {
  if (type == nullptr) {
    PyObject* imported = PyImport_ImportModule(module);
    if (imported == nullptr) return nullptr;
    type = reinterpret_cast<PyTypeObject*>(PyObject_GetAttrString(imported, name));
    Py_DECREF(imported);
    if (type == nullptr) return nullptr;
  }
  const auto allocate = reinterpret_cast<allocfunc>(PyType_GetSlot(type, Py_tp_alloc));
  return allocate(type, static_cast<Py_ssize_t>(count));
}

template <class T>
struct Value;

template <Number T>
struct Value<T> {
  static constexpr bool has_arrays = false;
  static T read(PyObject* from, Call&) {
    if constexpr (std::is_same_v<T, bool>) {
      const int truth = PyObject_IsTrue(from);
      if (truth < 0) mismatch("a bool", from);
      return truth == 1;
    } else if constexpr (std::is_floating_point_v<T>) {
      const double value = PyFloat_AsDouble(from);
      if (value == -1.0 && PyErr_Occurred()) mismatch("a float", from);
      return value;
    } else {
      PyObject* index = PyNumber_Index(from);
      if (index == nullptr) mismatch("an int", from);
      T value;
      if constexpr (std::is_signed_v<T>)
        value = static_cast<T>(PyLong_AsLongLong(index));
      else
        value = static_cast<T>(PyLong_AsUnsignedLongLong(index));
      Py_DECREF(index);
      if (value == static_cast<T>(-1) && PyErr_Occurred()) mismatch("an int of 64 bits", from);
      return value;
    }
  }
  static PyObject* make(T value, Call&) {
    if constexpr (std::is_same_v<T, bool>)
      return PyBool_FromLong(value);
    else if constexpr (std::is_floating_point_v<T>)
      return PyFloat_FromDouble(value);
    else if constexpr (std::is_signed_v<T>)
      return PyLong_FromLongLong(value);
    else
      return PyLong_FromUnsignedLongLong(value);
  }
};

template <class T, int N, bool Strided>
struct Value<Arr<T, N, Strided>> {
  static constexpr bool has_arrays = true;
  static bool fits(PyArrayObject* array) {
    const int type = PyArray_TYPE(array);
    const bool same = type == Element<T>::type || (Element<T>::type == NPY_INT64 && type == NPY_LONGLONG) ||
                      (Element<T>::type == NPY_UINT64 && type == NPY_ULONGLONG);
    return same && PyArray_NDIM(array) == N && PyArray_ISALIGNED(array) && PyArray_ISNOTSWAPPED(array) &&
           (Strided || PyArray_IS_C_CONTIGUOUS(array));
  }
  static std::string wanted() {
    return std::string(Strided ? "an array of " : "a contiguous array of ") + Element<T>::name +
           " with " + std::to_string(N) + " dimensions";
  }
  RT_APART static Arr<T, N, Strided> read(PyObject* from, Call& call) {
    PyArrayObject* array = nullptr;
    const bool written = call.writes();
    if (PyArray_Check(from) && fits(reinterpret_cast<PyArrayObject*>(from))) {
      array = reinterpret_cast<PyArrayObject*>(from);
      if (written && !PyArray_ISWRITEABLE(array)) throw Mismatch("is written, but read only");
    } else {
      // What is only read may be of any type and order that holds the same values.
      if (written || !PyArray_Check(from)) mismatch(wanted(), from);
      PyArray_Descr* type = PyArray_DescrFromType(Element<T>::type);
      if (!PyArray_CanCastSafely(PyArray_TYPE(reinterpret_cast<PyArrayObject*>(from)), Element<T>::type)) {
        Py_DECREF(type);
        mismatch(wanted(), from);
      }
      PyObject* copy = PyArray_FromAny(from, type, N, N, NPY_ARRAY_CARRAY_RO | NPY_ARRAY_NOTSWAPPED, nullptr);
      if (copy == nullptr) mismatch(wanted(), from);
      call.own(copy);
      array = reinterpret_cast<PyArrayObject*>(copy);
    }
    call.note(array);
    Arr<T, N, Strided> result;
    result.data = static_cast<T*>(PyArray_DATA(array));
    for (int k = 0; k < N; ++k) {
      result.n[k] = PyArray_DIM(array, k);
      if constexpr (Strided)
        result.steps[k] = PyArray_STRIDE(array, k) / static_cast<i64>(sizeof(T));
    }
    return result;
  }
  RT_APART static PyObject* make(const Arr<T, N, Strided>& value, Call& call) {
    npy_intp n[N];
    for (int k = 0; k < N; ++k) n[k] = value.n[k];
    PyArrayObject* holder =
        value.size() == 0 || arena.holds(value.data) ? nullptr : call.holder_of(value.data);
    if (holder == nullptr) {
      PyObject* result = PyArray_SimpleNew(N, n, Element<T>::type);
      if (result == nullptr) return nullptr;
      auto* to = static_cast<T*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(result)));
      if constexpr (Strided)
        each(value, [&](const T& x) { *to++ = x; });
      else if (value.size() > 0)
        std::memcpy(static_cast<void*>(to), value.data, sizeof(T) * static_cast<std::size_t>(value.size()));
      return result;
    }
    // The memory of an argument: that array itself, or a view of it.
    bool whole = PyArray_DATA(holder) == value.data && PyArray_NDIM(holder) == N;
    npy_intp steps[N];
    for (int k = 0; k < N; ++k) {
      whole = whole && PyArray_DIM(holder, k) == n[k];
      steps[k] = static_cast<npy_intp>(sizeof(T)) * value.step(k);
    }
    auto* owner = reinterpret_cast<PyObject*>(holder);
    Py_INCREF(owner);
    if (whole) return owner;
    PyObject* view = PyArray_New(&PyArray_Type, N, n, Element<T>::type, steps, value.data, 0,
                                 PyArray_ISWRITEABLE(holder) ? NPY_ARRAY_WRITEABLE : 0, nullptr);
    if (view == nullptr || PyArray_SetBaseObject(reinterpret_cast<PyArrayObject*>(view), owner) < 0) {
      Py_XDECREF(view);
      return nullptr;
    }
    return view;
  }
};

template <class... Q>
struct Value<std::tuple<Q...>> {
  static constexpr bool has_arrays = (Value<Q>::has_arrays || ...);
  static std::tuple<Q...> read(PyObject* from, Call& call) {
    check_tuple(from, sizeof...(Q), "tuple");
    Py_ssize_t k = 0;
    return std::tuple<Q...>{Value<Q>::read(PyTuple_GetItem(from, k++), call)...};
  }
  RT_APART static PyObject* make(const std::tuple<Q...>& value, Call& call) {
    return std::apply(
        [&](const auto&... each) {
          PyObject* items[] = {Value<Q>::make(each, call)...};
          return filled(PyTuple_New(sizeof...(Q)), items, sizeof...(Q));
        },
        value);
  }
};

template <Record R>
struct Value<R> {
  using Parts = decltype(std::declval<R>().parts());
  static constexpr bool has_arrays = Value<Parts>::has_arrays;
  RT_APART static R read(PyObject* from, Call& call) {
    constexpr int count = static_cast<int>(std::tuple_size_v<Parts>);
    check_tuple(from, count, R::record_name);
    return [&]<std::size_t... K>(std::index_sequence<K...>) {
      return R{(call.reading = R::record_fields[K],
                Value<std::tuple_element_t<K, Parts>>::read(PyTuple_GetItem(from, K), call))...};
    }(std::make_index_sequence<static_cast<std::size_t>(count)>{});
  }
  RT_APART static PyObject* make(const R& value, Call& call) {
    static PyTypeObject* type = nullptr;
    PyObject* tuple = empty_record(type, R::record_module, R::record_name, std::tuple_size_v<Parts>);
    return std::apply(
        [&](const auto&... each) {
          PyObject* items[] = {Value<std::decay_t<decltype(each)>>::make(each, call)...};
          return filled(tuple, items, sizeof...(each));
        },
        value.parts());
  }
};

// The name of a parameter.
RT_APART inline std::string parameter(const Loop& loop, std::size_t at) {
  const char* start = loop.parameters;
  for (; at > 0; --at) start = std::strchr(start, ',') + 1;
  return {start, std::strchr(start, ',')};
}
// Arguments in the order of the parameters; false with an error set where they do not fit.
RT_APART inline bool arrange(const Loop& loop, std::size_t wanted, PyObject* const* given,
                             Py_ssize_t count, PyObject* names, PyObject** arranged) {
  const auto placed = static_cast<std::size_t>(count);
  const auto named = static_cast<std::size_t>(names == nullptr ? 0 : PyTuple_Size(names));
  bool good = placed + named == wanted;
  for (std::size_t k = 0; good && k < wanted; ++k) arranged[k] = k < placed ? given[k] : nullptr;
  for (std::size_t k = 0; good && k < named; ++k) {
    PyObject* name = PyTuple_GetItem(names, static_cast<Py_ssize_t>(k));
    std::size_t at = placed;
    while (at < wanted &&
           PyUnicode_CompareWithASCIIString(name, parameter(loop, at).c_str()) != 0)
      ++at;
    good = at < wanted && arranged[at] == nullptr;
    if (good) arranged[at] = given[placed + k];
  }
  if (!good) PyErr_Format(PyExc_TypeError, "%s takes (%s)", loop.name, loop.parameters);
  return good;
}

// What went wrong, as an error of Python.
RT_APART inline PyObject* failed(const Call& call) {
  const Loop& loop = call.loop;
  try {
    throw;
  } catch (const Mismatch& error) {
    PyErr_Format(PyExc_TypeError, "%s, argument %s%s%s: %s", loop.name,
                 parameter(loop, call.at).c_str(), *call.reading ? "." : "", call.reading, error.what());
  } catch (const std::bad_alloc&) {
    PyErr_NoMemory();
  } catch (const std::out_of_range& error) {
    PyErr_Format(PyExc_IndexError, "%s: %s", loop.name, error.what());
  } catch (const std::exception& error) {
    PyErr_Format(PyExc_ValueError, "%s: %s", loop.name, error.what());
  }
  return nullptr;
}
template <class T>
RT_INLINE T argument(PyObject* const* arranged, std::size_t at, Call& call) {
  call.at = at;
  call.reading = "";
  return Value<T>::read(arranged[at], call);
}

using Method = PyObject* (*)(PyObject*, PyObject* const*, Py_ssize_t, PyObject*);
constexpr int METHOD = METH_FASTCALL | METH_KEYWORDS;
inline PyCFunction as_method(Method method) {
  return reinterpret_cast<PyCFunction>(reinterpret_cast<void*>(method));
}

}  // namespace rt
