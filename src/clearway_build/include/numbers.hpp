// Arithmetic as Python and NumPy mean it, for numbers and for arrays of up to two dimensions.
#pragma once
#include "arrays.hpp"

namespace rt {

template <class F, class T, int N, bool S>
RT_INLINE auto map(const Arr<T, N, S>& a, F f) {
  using R = decltype(f(widened(std::declval<T>())));
  std::array<i64, N> n;
  std::copy_n(a.n, N, n.begin());
  auto result = fresh<R, N>(n);
  i64 k = 0;
  each(a, [&](const T& value) { result.data[k++] = f(widened(value)); });
  return result;
}
template <class F, class X, class Y>
RT_INLINE auto map2(const X& a, const Y& b, F f) {
  if constexpr (!Array<X>) {
    return map(b, [&](auto y) { return f(a, y); });
  } else if constexpr (!Array<Y>) {
    return map(a, [&](auto x) { return f(x, b); });
  } else if constexpr (X::dims < Y::dims) {
    const i64 rows = b.n[0];
    auto first = f(get(a, i64{0}), get(b, i64{0}, i64{0}));
    auto result = empty<decltype(first)>(rows, b.n[1]);
    for (i64 i = 0; i < rows; ++i)
      for (i64 j = 0; j < b.n[1]; ++j) at(result, i, j) = f(get(a, j), get(b, i, j));
    return result;
  } else if constexpr (X::dims > Y::dims) {
    return map2(b, a, [&](auto y, auto x) { return f(x, y); });
  } else {
    using R = decltype(f(widened(std::declval<typename X::value>()),
                         widened(std::declval<typename Y::value>())));
    std::array<i64, X::dims> n;
    for (int k = 0; k < X::dims; ++k) n[k] = a.n[k] == 1 ? b.n[k] : a.n[k];
    auto result = fresh<R, X::dims>(n);
    if constexpr (X::dims == 1) {
      for (i64 i = 0; i < n[0]; ++i)
        result.data[i] = f(get(a, a.n[0] == 1 ? i64{0} : i), get(b, b.n[0] == 1 ? i64{0} : i));
    } else {
      static_assert(X::dims == 2, "two dimensions at most");
      for (i64 i = 0; i < n[0]; ++i)
        for (i64 j = 0; j < n[1]; ++j)
          at(result, i, j) = f(get(a, a.n[0] == 1 ? i64{0} : i, a.n[1] == 1 ? i64{0} : j),
                               get(b, b.n[0] == 1 ? i64{0} : i, b.n[1] == 1 ? i64{0} : j));
    }
    return result;
  }
}
template <class X, class Y>
concept OneArray = (Array<X> && (Array<Y> || Number<Y>)) || (Number<X> && Array<Y>);

#define RT_OPERATOR(op)                                        \
  template <class X, class Y>                                  \
    requires OneArray<X, Y>                                    \
  RT_INLINE auto operator op(const X& a, const Y& b) {         \
    return map2(a, b, [](auto x, auto y) { return x op y; });  \
  }
RT_OPERATOR(+)
RT_OPERATOR(-)
RT_OPERATOR(*)
RT_OPERATOR(<)
RT_OPERATOR(>)
RT_OPERATOR(<=)
RT_OPERATOR(>=)
RT_OPERATOR(==)
RT_OPERATOR(!=)
RT_OPERATOR(<<)
RT_OPERATOR(>>)
template <Array X>
RT_INLINE auto operator-(const X& a) {
  return map(a, [](auto x) { return -x; });
}

// Of two bools a bool, as in Python.
#define RT_BITS(name, op)                                            \
  template <class X, class Y>                                        \
  RT_INLINE auto name(const X& a, const Y& b) {                      \
    if constexpr (Array<X> || Array<Y>)                              \
      return map2(a, b, [](auto x, auto y) { return name(x, y); });  \
    else if constexpr (std::is_same_v<X, bool> && std::is_same_v<Y, bool>) \
      return static_cast<bool>(a op b);                              \
    else                                                             \
      return a op b;                                                 \
  }
RT_BITS(bit_and, &)
RT_BITS(bit_or, |)
RT_BITS(bit_xor, ^)
template <class X>
RT_INLINE auto invert(const X& a) {
  if constexpr (Array<X>)
    return map(a, [](auto x) { return invert(x); });
  else if constexpr (std::is_same_v<X, bool>)
    return !a;
  else
    return ~a;
}

template <class X, class Y>
RT_INLINE auto divide(const X& a, const Y& b) {
  if constexpr (Array<X> || Array<Y>)
    return map2(a, b, [](auto x, auto y) { return divide(x, y); });
  else
    return static_cast<f64>(a) / static_cast<f64>(b);
}
template <class X, class Y>
RT_INLINE auto floor_divide(const X& a, const Y& b) {
  if constexpr (Array<X> || Array<Y>) {
    return map2(a, b, [](auto x, auto y) { return floor_divide(x, y); });
  } else if constexpr (Integer<X> && Integer<Y>) {
    using R = std::common_type_t<X, Y>;
    if (b == 0) return R{0};
    R quotient = static_cast<R>(a / b);
    if constexpr (std::is_signed_v<R>)
      if (a % b != 0 && ((a < 0) != (b < 0))) --quotient;
    return quotient;
  } else {
    const f64 x = static_cast<f64>(a), y = static_cast<f64>(b), rest = std::fmod(x, y);
    f64 quotient = (x - rest) / y;
    if (rest != 0 && ((y < 0) != (rest < 0))) quotient -= 1.0;
    f64 whole = std::floor(quotient);
    if (quotient - whole > 0.5) whole += 1.0;
    return quotient == 0 ? std::copysign(0.0, x / y) : whole;
  }
}
template <class X, class Y>
RT_INLINE auto modulo(const X& a, const Y& b) {
  if constexpr (Array<X> || Array<Y>) {
    return map2(a, b, [](auto x, auto y) { return modulo(x, y); });
  } else if constexpr (Integer<X> && Integer<Y>) {
    using R = std::common_type_t<X, Y>;
    if (b == 0) return R{0};
    R rest = static_cast<R>(a % b);
    if constexpr (std::is_signed_v<R>)
      if (rest != 0 && ((rest < 0) != (b < 0))) rest += static_cast<R>(b);
    return rest;
  } else {
    const f64 y = static_cast<f64>(b);
    f64 rest = std::fmod(static_cast<f64>(a), y);
    if (rest == 0) return std::copysign(0.0, y);
    return (y < 0) != (rest < 0) ? rest + y : rest;
  }
}
// Squares of squares, in the order that numba multiplies them.
template <int P, class X>
RT_INLINE auto power(const X& a) {
  if constexpr (Array<X>) {
    return map(a, [](auto x) { return power<P>(x); });
  } else {
    X result = a, square = a;
    bool begun = false;
    for (int left = P; left != 0; left >>= 1) {
      if (left & 1) {
        result = begun ? result * square : square;
        begun = true;
      }
      square = square * square;
    }
    return result;
  }
}
RT_INLINE f64 power(f64 a, f64 b) { return std::pow(a, b); }

// Of equal or unordered ones, the first.
template <Number X, Number Y>
RT_INLINE auto least(X a, Y b) {
  using R = std::common_type_t<X, Y>;
  return static_cast<R>(b) < static_cast<R>(a) ? static_cast<R>(b) : static_cast<R>(a);
}
template <Number X, Number Y>
RT_INLINE auto most(X a, Y b) {
  using R = std::common_type_t<X, Y>;
  return static_cast<R>(b) > static_cast<R>(a) ? static_cast<R>(b) : static_cast<R>(a);
}
template <Number X, Number Y, Number... Z>
  requires(sizeof...(Z) > 0)
RT_INLINE auto least(X a, Y b, Z... rest) {
  return least(least(a, b), rest...);
}
template <Number X, Number Y, Number... Z>
  requires(sizeof...(Z) > 0)
RT_INLINE auto most(X a, Y b, Z... rest) {
  return most(most(a, b), rest...);
}
template <class X>
RT_INLINE auto absolute(const X& a) {
  if constexpr (Array<X>)
    return map(a, [](auto x) { return absolute(x); });
  else if constexpr (std::is_floating_point_v<X>)
    return std::fabs(a);
  else
    return a < 0 ? -a : a;
}
// What is no number of 64 bits becomes the least one, on every processor.
template <Number X>
RT_INLINE i64 integer(X a) {
  if constexpr (std::is_floating_point_v<X>)
    return a >= -0x1p63 && a < 0x1p63 ? static_cast<i64>(a) : std::numeric_limits<i64>::min();
  else
    return static_cast<i64>(a);
}

#define RT_FUNCTION(name, call)                            \
  template <class X>                                       \
  RT_INLINE auto name(const X& a) {                        \
    if constexpr (Array<X>)                                \
      return map(a, [](auto x) { return name(x); });       \
    else                                                   \
      return call(static_cast<f64>(a));                    \
  }
RT_FUNCTION(sqrt, std::sqrt)
RT_FUNCTION(cos, std::cos)
RT_FUNCTION(sin, std::sin)
RT_FUNCTION(tan, std::tan)
RT_FUNCTION(acos, std::acos)
RT_FUNCTION(asin, std::asin)
RT_FUNCTION(atan, std::atan)
RT_FUNCTION(exp, std::exp)
RT_FUNCTION(expm1, std::expm1)
RT_FUNCTION(log, std::log)
RT_FUNCTION(log1p, std::log1p)
RT_FUNCTION(erf, std::erf)
RT_FUNCTION(floor, std::floor)
RT_FUNCTION(ceil, std::ceil)
RT_FUNCTION(rint, std::nearbyint)
RT_FUNCTION(isnan, std::isnan)
RT_FUNCTION(isinf, std::isinf)
RT_FUNCTION(isfinite, std::isfinite)
#define RT_FUNCTION2(name, call)                                    \
  template <class X, class Y>                                       \
  RT_INLINE auto name(const X& a, const Y& b) {                     \
    if constexpr (Array<X> || Array<Y>)                             \
      return map2(a, b, [](auto x, auto y) { return name(x, y); }); \
    else                                                            \
      return call(static_cast<f64>(a), static_cast<f64>(b));        \
  }
RT_FUNCTION2(atan2, std::atan2)
RT_FUNCTION2(hypot, std::hypot)
RT_FUNCTION2(copysign, std::copysign)
RT_FUNCTION2(nextafter, std::nextafter)
RT_INLINE i64 gcd(i64 a, i64 b) { return std::gcd(a, b); }

// --- Over arrays. Sums go one by one, in order.
template <Array X>
RT_INLINE auto sum(const X& a) {
  using T = decltype(widened(std::declval<typename X::value>()));
  std::conditional_t<std::is_same_v<T, bool>, i64, T> result{};
  each(a, [&](const auto& x) { result += x; });
  return result;
}
template <Array X>
RT_INLINE auto sum_of_rows(const X& a) {
  auto result = empty<f64>(a.n[0]);
  for (i64 i = 0; i < a.n[0]; ++i) result.data[i] = sum(at(a, i));
  return result;
}
template <Array X>
RT_INLINE f64 mean(const X& a) {
  return static_cast<f64>(sum(a)) / static_cast<f64>(a.size());
}
template <Array X>
RT_INLINE auto max(const X& a) {
  auto result = widened(typename X::value{});
  bool first = true;
  each(a, [&](const auto& x) {
    if (first || x > result || x != x) result = x;
    first = false;
  });
  return result;
}
template <Array X>
RT_INLINE auto min(const X& a) {
  auto result = widened(typename X::value{});
  bool first = true;
  each(a, [&](const auto& x) {
    if (first || x < result || x != x) result = x;
    first = false;
  });
  return result;
}
template <Array X>
RT_INLINE bool any(const X& a) {
  bool result = false;
  each(a, [&](const auto& x) { result = result || x != 0; });
  return result;
}
template <Array X>
RT_INLINE bool all(const X& a) {
  bool result = true;
  each(a, [&](const auto& x) { result = result && x != 0; });
  return result;
}
template <Array X>
RT_INLINE i64 count_nonzero(const X& a) {
  i64 result = 0;
  each(a, [&](const auto& x) { result += x != 0; });
  return result;
}
template <Array X>
RT_INLINE auto copy(const X& a) {
  return map(a, [](auto x) { return static_cast<typename X::value>(x); });
}
template <class T, Array X>
RT_INLINE auto astype(const X& a) {
  return map(a, [](auto x) { return static_cast<T>(x); });
}
template <Array X>
RT_INLINE auto empty_like(const X& a) {
  return copy(a);
}
// Not-a-number last; equal ones stay as they are, with every library alike.
struct Ordered {
  template <class T>
  bool operator()(const T& a, const T& b) const {
    return a < b || (b != b && a == a);
  }
};
template <Array X>
RT_INLINE void sort_in_place(const X& a) {
  static_assert(!X::strided && X::dims == 1, "contiguous, of one dimension");
  std::stable_sort(a.data, a.data + a.size(), Ordered{});
}
template <Array X>
RT_INLINE auto sort(const X& a) {
  auto result = copy(a);
  sort_in_place(result);
  return result;
}
// All in order: what a partition leaves to chance differs from library to library.
template <Array X>
RT_INLINE auto partition(const X& a, i64) {
  return sort(a);
}
template <class T = i64>
RT_INLINE auto arange(i64 low, i64 high) {
  auto result = empty<T>(std::max<i64>(0, high - low));
  for (i64 k = low; k < high; ++k) result.data[k - low] = static_cast<T>(k);
  return result;
}
template <class T = i64>
RT_INLINE auto arange(i64 high) {
  return arange<T>(0, high);
}
template <Array X>
RT_INLINE auto argsort(const X& a) {
  auto result = arange(a.n[0]);
  std::stable_sort(result.data, result.data + result.n[0],
                   [&](i64 p, i64 q) { return Ordered{}(at(a, p), at(a, q)); });
  return result;
}
template <Array X>
RT_INLINE auto flatnonzero(const X& a) {
  auto result = empty<i64>(count_nonzero(a));
  i64 to = 0, k = 0;
  each(a, [&](const auto& x) {
    if (x != 0) result.data[to++] = k;
    ++k;
  });
  return result;
}
template <Array X>
RT_INLINE auto cumsum(const X& a) {
  auto result = map(a, [](auto x) { return x; });
  for (i64 k = 1; k < result.n[0]; ++k) result.data[k] += result.data[k - 1];
  return result;
}
template <Array X>
RT_INLINE auto diff(const X& a) {
  using T = typename X::value;
  auto result = empty<T>(std::max<i64>(0, a.n[0] - 1));
  for (i64 k = 0; k < result.n[0]; ++k) result.data[k] = static_cast<T>(at(a, k + 1) - at(a, k));
  return result;
}
template <Array X, Array Y>
RT_INLINE auto append(const X& a, const Y& b) {
  auto result = empty<typename X::value>(a.n[0] + b.n[0]);
  for (i64 k = 0; k < a.n[0]; ++k) result.data[k] = at(a, k);
  for (i64 k = 0; k < b.n[0]; ++k)
    result.data[a.n[0] + k] = static_cast<typename X::value>(at(b, k));
  return result;
}
template <class... Q>
RT_INLINE auto array(Q... values) {
  using T = std::common_type_t<Q...>;
  auto result = empty<T>(i64{sizeof...(Q)});
  i64 k = 0;
  ((result.data[k++] = static_cast<T>(values)), ...);
  return result;
}
template <class T>
RT_INLINE auto array(const List<T>& list) {
  auto result = empty<T>(list.size());
  std::copy(list.values.begin(), list.values.end(), result.data);
  return result;
}
RT_INLINE auto linspace(f64 low, f64 high, i64 count) {
  auto result = empty<f64>(count);
  const f64 step = (high - low) / static_cast<f64>(count - 1);
  for (i64 k = 0; k < count; ++k) result.data[k] = low + static_cast<f64>(k) * step;
  if (count == 1) result.data[0] = low;
  if (count > 1) result.data[count - 1] = high;
  return result;
}
template <Array X, Array Y>
RT_INLINE auto cross(const X& a, const Y& b) {
  return array(at(a, 1) * at(b, 2) - at(a, 2) * at(b, 1), at(a, 2) * at(b, 0) - at(a, 0) * at(b, 2),
               at(a, 0) * at(b, 1) - at(a, 1) * at(b, 0));
}
template <class T, int N, bool S>
RT_INLINE Arr<T, 1> ravel(const Arr<T, N, S>& a) {
  if constexpr (S)
    return ravel(copy(a));
  else
    return {a.data, {a.size()}};
}
template <class T, int N, Integer... I>
RT_INLINE auto reshape(const Arr<T, N>& a, I... n) {
  Arr<T, sizeof...(I)> result{a.data, {static_cast<i64>(n)...}};
  for (auto& count : result.n)
    if (count < 0) {
      i64 others = 1;
      for (auto other : result.n)
        if (other >= 0) others *= other;
      count = others == 0 ? 0 : a.size() / others;
    }
  return result;
}
template <class T, bool S>
RT_INLINE Arr<T, 2, true> transposed(const Arr<T, 2, S>& a) {
  return {a.data, {a.n[1], a.n[0]}, {a.step(1), a.step(0)}};
}

}  // namespace rt
