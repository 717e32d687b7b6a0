// Integers of a fixed number of 64-bit words, for exact signs that 128 bits do not hold.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace relief::detail {

__extension__ using Int128 = __int128;

/// A signed integer of 64 N bits in two's complement. Sums wrap around; the caller knows how large his numbers become.
template <std::size_t N>
struct WideInt {
  std::array<std::uint64_t, N> words{};  ///< the lowest first

  constexpr WideInt() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): a number is a number.
  constexpr WideInt(Int128 value) noexcept {
    for (std::size_t k = 0; k < N; ++k) words[k] = k < 2 ? static_cast<std::uint64_t>(value >> (64 * k)) : fill(value);
  }

  [[nodiscard]] constexpr bool is_negative() const noexcept { return words[N - 1] >> 63U != 0; }
  [[nodiscard]] constexpr int sign() const noexcept {
    if (is_negative()) return -1;
    for (const std::uint64_t word : words)
      if (word != 0) return 1;
    return 0;
  }
  constexpr WideInt& operator+=(const WideInt& b) noexcept {
    unsigned carry = 0;
    for (std::size_t k = 0; k < N; ++k) {
      const std::uint64_t sum = words[k] + b.words[k], all = sum + carry;
      carry = static_cast<unsigned>(sum < b.words[k]) | static_cast<unsigned>(all < sum);
      words[k] = all;
    }
    return *this;
  }
  [[nodiscard]] constexpr WideInt operator-() const noexcept {
    WideInt r;
    unsigned carry = 1;
    for (std::size_t k = 0; k < N; ++k) {
      r.words[k] = ~words[k] + carry;
      carry = static_cast<unsigned>(carry != 0 && r.words[k] == 0);
    }
    return r;
  }
  constexpr WideInt& operator-=(const WideInt& b) noexcept { return *this += -b; }
  friend constexpr WideInt operator+(WideInt a, const WideInt& b) noexcept { return a += b; }
  friend constexpr WideInt operator-(WideInt a, const WideInt& b) noexcept { return a -= b; }
  friend constexpr bool operator==(const WideInt& a, const WideInt& b) noexcept = default;

  /// Without loss.
  template <std::size_t M>
  friend constexpr WideInt<N + M> operator*(const WideInt& a, const WideInt<M>& b) noexcept {
    const WideInt x = a.is_negative() ? -a : a;
    const WideInt<M> y = b.is_negative() ? -b : b;
    WideInt<N + M> r;
    for (std::size_t i = 0; i < N; ++i) {
      if (x.words[i] == 0) continue;
      std::uint64_t carry = 0;
      for (std::size_t j = 0; j < M; ++j) {
        const Unsigned128 all = Unsigned128{x.words[i]} * y.words[j] + r.words[i + j] + carry;
        r.words[i + j] = static_cast<std::uint64_t>(all);
        carry = static_cast<std::uint64_t>(all >> 64U);
      }
      r.words[i + M] = carry;
    }
    return a.is_negative() != b.is_negative() ? -r : r;
  }
  /// Times two.
  constexpr void double_it() noexcept {
    for (std::size_t k = N; k-- > 0;) words[k] = words[k] << 1U | (k > 0 ? words[k - 1] >> 63U : 0);
  }

 private:
  __extension__ using Unsigned128 = unsigned __int128;
  static constexpr std::uint64_t fill(Int128 value) noexcept { return value < 0 ? ~std::uint64_t{0} : 0; }
};

}  // namespace relief::detail
