// What translated loops are made of: an arena of temporaries, arrays, how they are indexed.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>
#define RT_INLINE inline

using f64 = double;
using i64 = std::int64_t;
using i32 = std::int32_t;
using i16 = std::int16_t;
using i8 = std::int8_t;
using u64 = std::uint64_t;
using u32 = std::uint32_t;
using u8 = std::uint8_t;

namespace rt {

// Memory of temporaries. A scope gives back all that was taken since it began; nothing in it is
// ever destroyed. One thread at a time: loops hold the interpreter's lock.
class Arena {
 public:
  struct Mark {
    std::size_t chunk, used;
  };
  void* take(std::size_t size) {
    size = (size + 63) & ~std::size_t{63};
    while (at_ < chunks_.size()) {
      if (used_ + size <= chunks_[at_].size) {
        void* place = chunks_[at_].start + used_;
        used_ += size;
        return place;
      }
      ++at_;
      used_ = 0;
    }
    const std::size_t room = std::max(size, kChunk);
    auto* start = static_cast<char*>(std::aligned_alloc(64, room));
    if (start == nullptr) throw std::bad_alloc();
    chunks_.push_back({start, room});
    held_ += room;
    used_ = size;
    return start;
  }
  Mark mark() const { return {at_, used_}; }
  void give_back(Mark mark) {
#ifdef CLEARWAY_CHECKED
    // Whoever looks at it still finds no numbers.
    for (std::size_t k = mark.chunk; k <= at_ && k < chunks_.size(); ++k) {
      const std::size_t from = k == mark.chunk ? mark.used : 0;
      std::memset(chunks_[k].start + from, 0xFF, (k == at_ ? used_ : chunks_[k].size) - from);
    }
#endif
    at_ = mark.chunk;
    used_ = mark.used;
    // What a large call took goes back to the system when it is over.
    if (at_ == 0 && used_ == 0)
      while (held_ > kKept) {
        held_ -= chunks_.back().size;
        std::free(chunks_.back().start);
        chunks_.pop_back();
      }
  }
  bool holds(const void* place) const {
    const auto* p = static_cast<const char*>(place);
    for (const auto& chunk : chunks_)
      if (p >= chunk.start && p < chunk.start + chunk.size) return true;
    return false;
  }

 private:
  struct Chunk {
    char* start;
    std::size_t size;
  };
  static constexpr std::size_t kChunk = std::size_t{1} << 20, kKept = std::size_t{32} << 20;
  std::vector<Chunk> chunks_;
  std::size_t at_ = 0, used_ = 0, held_ = 0;
};
inline Arena arena;

struct Scope {
  Arena::Mark mark = arena.mark();
  Scope() = default;
  Scope(const Scope&) = delete;
  Scope& operator=(const Scope&) = delete;
  ~Scope() { arena.give_back(mark); }
};

// An array of N dimensions; contiguous in C's order unless strided. Strides count elements.
template <class T, int N, bool Strided = false>
struct Arr {
  using value = T;
  static constexpr int dims = N;
  static constexpr bool strided = false;
  T* data;
  i64 n[N];
  RT_INLINE i64 step(int axis) const {
    i64 result = 1;
    for (int k = N - 1; k > axis; --k) result *= n[k];
    return result;
  }
  RT_INLINE i64 size() const {
    i64 result = 1;
    for (int k = 0; k < N; ++k) result *= n[k];
    return result;
  }
  RT_INLINE operator Arr<T, N, true>() const {
    Arr<T, N, true> result;
    result.data = data;
    for (int k = 0; k < N; ++k) {
      result.n[k] = n[k];
      result.steps[k] = step(k);
    }
    return result;
  }
};
template <class T, int N>
struct Arr<T, N, true> {
  using value = T;
  static constexpr int dims = N;
  static constexpr bool strided = true;
  T* data;
  i64 n[N];
  i64 steps[N];
  RT_INLINE i64 step(int axis) const { return steps[axis]; }
  RT_INLINE i64 size() const {
    i64 result = 1;
    for (int k = 0; k < N; ++k) result *= n[k];
    return result;
  }
};

template <class X>
struct is_array : std::false_type {};
template <class T, int N, bool S>
struct is_array<Arr<T, N, S>> : std::true_type {};
template <class X>
concept Array = is_array<std::decay_t<X>>::value;
template <class X>
concept Number = std::is_arithmetic_v<std::decay_t<X>>;
template <class X>
concept Integer = std::is_integral_v<std::decay_t<X>>;

// Loops compute with 64 bits; narrower ones are only kept.
template <Number T>
RT_INLINE auto widened(T value) {
  if constexpr (std::is_same_v<T, bool> || std::is_floating_point_v<T> || sizeof(T) == 8)
    return value;
  else
    return static_cast<i64>(value);
}

template <class T, int N>
RT_INLINE Arr<T, N> fresh(const std::array<i64, N>& n) {
  Arr<T, N> result;
  for (int k = 0; k < N; ++k) {
    if (n[k] < 0) throw std::length_error("negative dimensions are not allowed");
    result.n[k] = n[k];
  }
  result.data = static_cast<T*>(
      arena.take(sizeof(T) * static_cast<std::size_t>(std::max<i64>(result.size(), 1))));
  return result;
}
template <class T, Integer... I>
RT_INLINE auto empty(I... n) {
  return fresh<T, sizeof...(I)>({static_cast<i64>(n)...});
}
template <class T, class V, Integer... I>
RT_INLINE auto full(V value, I... n) {
  auto result = empty<T>(n...);
  std::fill_n(result.data, result.size(), static_cast<T>(value));
  return result;
}
template <class T, Integer... I>
RT_INLINE auto zeros(I... n) {
  auto result = empty<T>(n...);
  std::memset(static_cast<void*>(result.data), 0,
              sizeof(T) * static_cast<std::size_t>(result.size()));
  return result;
}
template <class T, Integer... I>
RT_INLINE auto ones(I... n) {
  return full<T>(T{1}, n...);
}
template <class T, class... I>
RT_INLINE auto empty(const std::tuple<I...>& shape) {
  return std::apply([](auto... n) { return empty<T>(n...); }, shape);
}
template <class T, class... I>
RT_INLINE auto zeros(const std::tuple<I...>& shape) {
  return std::apply([](auto... n) { return zeros<T>(n...); }, shape);
}
template <class T, class V, class... I>
RT_INLINE auto full(V value, const std::tuple<I...>& shape) {
  return std::apply([&](auto... n) { return full<T>(value, n...); }, shape);
}

// A table that stands in the source: nobody writes it.
template <class T, Integer... I>
RT_INLINE auto table(const T* values, I... n) {
  Arr<T, sizeof...(I)> result{const_cast<T*>(values), {static_cast<i64>(n)...}};
  return result;
}

struct Slice {
  i64 low, high;
  bool has_low, has_high;
};
RT_INLINE std::pair<i64, i64> bounds_of(const Slice& s, i64 n) {
  i64 low = !s.has_low ? 0 : s.low < 0 ? std::max<i64>(0, s.low + n) : std::min(s.low, n);
  i64 high = !s.has_high ? n : s.high < 0 ? std::max<i64>(0, s.high + n) : std::min(s.high, n);
  return {low, std::max(low, high)};
}
template <Integer I>
RT_INLINE i64 place_of(I index, i64 n) {
  i64 place = static_cast<i64>(index);
  if constexpr (std::is_signed_v<I>) place = place < 0 ? place + n : place;
#ifdef CLEARWAY_CHECKED
  if (place < 0 || place >= n)
    throw std::out_of_range("index " + std::to_string(place) + " is out of bounds for size " +
                            std::to_string(n));
#else
  (void)n;
#endif
  return place;
}

template <class I>
inline constexpr bool is_slice = std::is_same_v<I, Slice>;

template <class T, int N, bool S, class... I>
  requires((Integer<I> || is_slice<I>) && ...)
RT_INLINE decltype(auto) at(const Arr<T, N, S>& a, I... index) {
  constexpr int given = sizeof...(I), slices = (0 + ... + int{is_slice<I>});
  static_assert(given <= N, "too many indices");
  if constexpr (slices == 0 && given == N) {
    i64 offset = 0;
    int axis = 0;
    if constexpr (S)
      ((offset += place_of(index, a.n[axis]) * a.steps[axis], ++axis), ...);
    else
      ((offset = offset * a.n[axis] + place_of(index, a.n[axis]), ++axis), ...);
    return (a.data[offset]);
  } else {
    // Contiguous still where whole rows were picked, and a stretch of them at most.
    constexpr bool first_slice_last = [] {
      constexpr bool kinds[] = {is_slice<I>...};
      for (int k = 0; k + 1 < given; ++k)
        if (kinds[k]) return false;
      return true;
    }();
    constexpr int left = N - (given - slices);
    Arr<T, left, S || !first_slice_last> result;
    T* data = a.data;
    int axis = 0, to = 0;
    i64 steps[N];
    auto one = [&](auto i) {
      if constexpr (is_slice<decltype(i)>) {
        auto [low, high] = bounds_of(i, a.n[axis]);
        data += low * a.step(axis);
        result.n[to] = high - low;
        steps[to++] = a.step(axis);
      } else {
        data += place_of(i, a.n[axis]) * a.step(axis);
      }
      ++axis;
    };
    (one(index), ...);
    for (; axis < N; ++axis) {
      result.n[to] = a.n[axis];
      steps[to++] = a.step(axis);
    }
    result.data = data;
    if constexpr (S || !first_slice_last)
      for (int k = 0; k < left; ++k) result.steps[k] = steps[k];
    return result;
  }
}

// The common cases once more, without anything to unfold: they are most of what is compiled.
template <class T, Integer I>
RT_INLINE T& at(const Arr<T, 1, false>& a, I i) {
  return a.data[place_of(i, a.n[0])];
}
template <class T, Integer I, Integer J>
RT_INLINE T& at(const Arr<T, 2, false>& a, I i, J j) {
  return a.data[place_of(i, a.n[0]) * a.n[1] + place_of(j, a.n[1])];
}
template <class T, Integer I, Integer J, Integer K>
RT_INLINE T& at(const Arr<T, 3, false>& a, I i, J j, K k) {
  return a.data[(place_of(i, a.n[0]) * a.n[1] + place_of(j, a.n[1])) * a.n[2] + place_of(k, a.n[2])];
}

// Some of the rows: by number, or by a mask.
template <class T, int N, bool S, class I, bool R>
  requires(Integer<I> && N <= 2)
RT_INLINE auto at(const Arr<T, N, S>& a, const Arr<I, 1, R>& rows) {
  i64 count = rows.n[0];
  if constexpr (std::is_same_v<I, bool>) {
    count = 0;
    for (i64 k = 0; k < rows.n[0]; ++k) count += at(rows, k);
  }
  std::array<i64, N> n;
  n[0] = count;
  if constexpr (N == 2) n[1] = a.n[1];
  auto result = fresh<T, N>(n);
  i64 to = 0;
  for (i64 k = 0; k < rows.n[0]; ++k) {
    i64 row = k;
    if constexpr (std::is_same_v<I, bool>) {
      if (!at(rows, k)) continue;
    } else {
      row = static_cast<i64>(at(rows, k));
    }
    if constexpr (N == 1)
      result.data[to] = at(a, row);
    else
      for (i64 q = 0; q < n[1]; ++q) result.data[to * n[1] + q] = at(a, row, q);
    ++to;
  }
  return result;
}
// Of a tuple, by a number that is known only when it runs.
template <class... Q, Integer I>
RT_INLINE auto at(const std::tuple<Q...>& values, I index) {
  return std::apply(
      [&](auto... each) {
        using T = std::common_type_t<decltype(each)...>;
        const T all[] = {static_cast<T>(each)...};
        return all[place_of(index, sizeof...(Q))];
      },
      values);
}

template <class T>
struct List {
  std::vector<T> values;
  i64 size() const { return static_cast<i64>(values.size()); }
};
template <class X>
inline constexpr bool is_list = false;
template <class T>
inline constexpr bool is_list<List<T>> = true;
template <class T, Integer I>
RT_INLINE T at(const List<T>& list, I index) {
  return list.values[static_cast<std::size_t>(place_of(index, list.size()))];
}
template <class First, class... Q>
RT_INLINE auto list_of(First first, Q... rest) {
  return List<First>{{first, rest...}};
}
template <class T, Integer I>
RT_INLINE auto get(const Arr<T, 1, false>& a, I i) {
  return widened(a.data[place_of(i, a.n[0])]);
}
template <class T, Integer I, Integer J>
RT_INLINE auto get(const Arr<T, 2, false>& a, I i, J j) {
  return widened(a.data[place_of(i, a.n[0]) * a.n[1] + place_of(j, a.n[1])]);
}
template <class X, class... I>
RT_INLINE auto get(const X& from, I... index) {
  using R = decltype(at(from, index...));
  if constexpr (Number<R>)
    return widened(std::decay_t<R>(at(from, index...)));
  else
    return at(from, index...);
}

template <class F, class T, int N, bool S>
RT_INLINE void each(const Arr<T, N, S>& a, F f) {
  if constexpr (!S) {
    const i64 size = a.size();
    for (i64 k = 0; k < size; ++k) f(a.data[k]);
  } else if constexpr (N == 1) {
    for (i64 k = 0; k < a.n[0]; ++k) f(at(a, k));
  } else {
    for (i64 k = 0; k < a.n[0]; ++k) each(at(a, k), f);
  }
}

// --- What values become
template <class To, class From>
RT_INLINE To to(const From& from) {
  if constexpr (std::is_same_v<To, From>) {
    return from;
  } else if constexpr (Number<To> && Number<From>) {
    static_assert(!(Integer<To> && std::is_floating_point_v<From>), "a float is no int");
    static_assert(std::is_same_v<To, bool> == std::is_same_v<From, bool> || !std::is_same_v<To, bool>,
                  "a number is no bool");
    static_assert(!(Integer<To> && Integer<From>) || sizeof(From) < 8 ||
                      std::is_signed_v<To> == std::is_signed_v<From>,
                  "signed and unsigned differ");
    return static_cast<To>(from);
  } else if constexpr (Array<To> || Array<From>) {
    return from;
  } else {
    return std::apply(
        [](const auto&... each) {
          return [&]<std::size_t... K>(std::index_sequence<K...>) {
            return To{to<std::tuple_element_t<K, To>>(each)...};
          }(std::make_index_sequence<std::tuple_size_v<To>>{});
        },
        from);
  }
}
template <class T, int N, bool S, class V>
RT_INLINE void fill(const Arr<T, N, S>& a, const V& value) {
  if constexpr (Array<V>) {
    if constexpr (V::dims < N) {
      for (i64 k = 0; k < a.n[0]; ++k) fill(at(a, k), value);
    } else {
      for (i64 k = 0; k < a.n[0]; ++k) {
        const i64 from = value.n[0] == 1 ? 0 : k;
        if constexpr (N == 1)
          at(a, k) = static_cast<T>(at(value, from));
        else
          fill(at(a, k), at(value, from));
      }
    }
  } else if constexpr (Number<V>) {
    each(a, [&](T& to) { to = static_cast<T>(value); });
  } else {
    i64 k = 0;
    std::apply([&](const auto&... each) { ((at(a, k++) = static_cast<T>(each)), ...); }, value);
  }
}
template <Number T, class V>
RT_INLINE void store(T& place, const V& value) {
  place = static_cast<T>(value);
}
template <class T, int N, bool S, class V>
RT_INLINE void store(const Arr<T, N, S>& place, const V& value) {
  fill(place, value);
}
// Into one place, or a view.
template <class X, class V, class... I>
RT_INLINE void put(const X& array, const V& value, I... index) {
  store(at(array, index...), value);
}
// Into some of the rows, by number or by a mask: one value for all, or one for each.
template <class T, int N, bool S, class V, class I, bool R>
RT_INLINE void put(const Arr<T, N, S>& array, const V& value, const Arr<I, 1, R>& rows) {
  i64 from = 0;
  for (i64 k = 0; k < rows.n[0]; ++k) {
    i64 row = k;
    if constexpr (std::is_same_v<I, bool>) {
      if (!at(rows, k)) continue;
    } else {
      row = static_cast<i64>(at(rows, k));
    }
    if constexpr (!Array<V>)
      store(at(array, row), value);
    else if constexpr (V::dims == N)
      store(at(array, row), at(value, value.n[0] == 1 ? i64{0} : from));
    else
      store(at(array, row), value);
    ++from;
  }
}
// In place, as Python's `+=` is for arrays.
template <class X, class V>
RT_INLINE void update(X& place, const V& value) {
  if constexpr (Array<X>)
    fill(place, value);
  else
    place = to<X>(value);
}

// --- Parts of values
template <class X>
concept Record = requires { std::decay_t<X>::record_name; };
template <int K, class X>
RT_INLINE auto sub(const X& from) {
  if constexpr (Array<X> || is_list<X>) {
    return get(from, i64{K});
  } else if constexpr (Record<X>) {
    return sub<K>(from.parts());
  } else {
    constexpr int count = static_cast<int>(std::tuple_size_v<X>);
    return std::get<(K < 0 ? count + K : K)>(from);
  }
}
template <int K, class X>
RT_INLINE auto tail(const X& from) {
  return [&]<std::size_t... N>(std::index_sequence<N...>) {
    return std::make_tuple(std::get<K + N>(from)...);
  }(std::make_index_sequence<std::tuple_size_v<X> - K>{});
}
template <class X>
RT_INLINE auto parts_of(const X& from) {
  if constexpr (Record<X>)
    return from.parts();
  else
    return from;
}
template <class X>
RT_INLINE i64 len(const X& of) {
  if constexpr (Array<X>)
    return of.n[0];
  else if constexpr (is_list<X>)
    return of.size();
  else
    return static_cast<i64>(std::tuple_size_v<X>);
}
template <class X>
RT_INLINE auto shape_of(const X& of) {
  if constexpr (Array<X>)
    return [&]<std::size_t... K>(std::index_sequence<K...>) {
      return std::make_tuple(of.n[K]...);
    }(std::make_index_sequence<X::dims>{});
  else
    return of.shape;
}
template <class X>
RT_INLINE auto size_of(const X& of) {
  if constexpr (Array<X>)
    return of.size();
  else
    return of.size;
}

template <class T, class V>
RT_INLINE void append(List<T>& list, const V& value) {
  list.values.push_back(to<T>(value));
}
// As heapq: entries are all different, or equal in all that they hold.
template <class T, class V>
RT_INLINE void heappush(List<T>& list, const V& value) {
  list.values.push_back(to<T>(value));
  std::push_heap(list.values.begin(), list.values.end(), std::greater<T>());
}
template <class T>
RT_INLINE T heappop(List<T>& list) {
  std::pop_heap(list.values.begin(), list.values.end(), std::greater<T>());
  T result = list.values.back();
  list.values.pop_back();
  return result;
}

}  // namespace rt
