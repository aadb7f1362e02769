/// Symmetric matrices over x, y and yaw: what numpy.linalg does, without its overhead for three rows.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace glass_nav {

using Vector3 = std::array<double, 3>;

/// Row-major.
struct Matrix3 {
  std::array<double, 9> values{};

  double& operator()(std::size_t row, std::size_t column) { return values[3 * row + column]; }
  double operator()(std::size_t row, std::size_t column) const { return values[3 * row + column]; }

  static Matrix3 diagonal(double value) {
    Matrix3 result;
    for (std::size_t i = 0; i < 3; ++i) result(i, i) = value;
    return result;
  }

  /// Adds weight times the outer product of a vector with itself.
  void add_outer(const Vector3& vector, double weight) {
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) (*this)(i, j) += weight * vector[i] * vector[j];
  }
};

inline Matrix3 operator*(const Matrix3& one, const Matrix3& other) {
  Matrix3 result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) result(i, j) += one(i, k) * other(k, j);
  return result;
}

inline Matrix3 operator+(const Matrix3& one, const Matrix3& other) {
  Matrix3 result;
  for (std::size_t i = 0; i < 9; ++i) result.values[i] = one.values[i] + other.values[i];
  return result;
}

inline Vector3 operator*(const Matrix3& matrix, const Vector3& vector) {
  Vector3 result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) result[i] += matrix(i, j) * vector[j];
  return result;
}

inline Matrix3 transposed(const Matrix3& matrix) {
  Matrix3 result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) result(i, j) = matrix(j, i);
  return result;
}

inline double dot(const Vector3& one, const Vector3& other) {
  return one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
}

/// Lower triangular L with L L^T = matrix. Throws invalid_argument if the matrix is not positive definite.
inline Matrix3 cholesky(const Matrix3& matrix) {
  Matrix3 root;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double rest = matrix(i, j);
      for (std::size_t k = 0; k < j; ++k) rest -= root(i, k) * root(j, k);
      if (i == j && !(rest > 0.0)) throw std::invalid_argument("the covariance is not positive definite");
      root(i, j) = i == j ? std::sqrt(rest) : rest / root(j, j);
    }
  }
  return root;
}

/// L^-1 vector, of a lower triangular matrix.
inline Vector3 solved(const Matrix3& root, const Vector3& vector) {
  Vector3 result{};
  for (std::size_t i = 0; i < 3; ++i) {
    double rest = vector[i];
    for (std::size_t k = 0; k < i; ++k) rest -= root(i, k) * result[k];
    result[i] = rest / root(i, i);
  }
  return result;
}

/// L^-1 matrix L^-T.
inline Matrix3 whitened(const Matrix3& root, const Matrix3& matrix) {
  const auto by_column = [&root](const Matrix3& from) {
    Matrix3 result;
    for (std::size_t j = 0; j < 3; ++j) {
      const Vector3 column = solved(root, {from(0, j), from(1, j), from(2, j)});
      for (std::size_t i = 0; i < 3; ++i) result(i, j) = column[i];
    }
    return result;
  };
  return by_column(transposed(by_column(matrix)));
}

/// Of a symmetric positive definite matrix.
inline Matrix3 inverse(const Matrix3& m) {
  const double c00 = m(1, 1) * m(2, 2) - m(1, 2) * m(1, 2), c01 = m(0, 2) * m(1, 2) - m(0, 1) * m(2, 2),
               c02 = m(0, 1) * m(1, 2) - m(0, 2) * m(1, 1), c11 = m(0, 0) * m(2, 2) - m(0, 2) * m(0, 2),
               c12 = m(0, 1) * m(0, 2) - m(0, 0) * m(1, 2), c22 = m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1);
  const double scale = 1.0 / (m(0, 0) * c00 + m(0, 1) * c01 + m(0, 2) * c02);
  Matrix3 result{{c00, c01, c02, c01, c11, c12, c02, c12, c22}};
  for (double& value : result.values) value *= scale;
  return result;
}

struct Eigen3 {
  Vector3 values;
  Matrix3 axes;  // one in each column
};

/// Of a symmetric matrix, by Jacobi rotations: Golub, Van Loan, Matrix Computations (2013), sec. 8.5.
inline Eigen3 eigen(Matrix3 m) {
  Matrix3 axes = Matrix3::diagonal(1.0);
  for (int sweep = 0; sweep < 30; ++sweep) {
    const double off = std::abs(m(0, 1)) + std::abs(m(0, 2)) + std::abs(m(1, 2));
    const double size = std::abs(m(0, 0)) + std::abs(m(1, 1)) + std::abs(m(2, 2));
    if (!(off > 1e-17 * size)) break;
    for (std::size_t p = 0; p < 2; ++p) {
      for (std::size_t q = p + 1; q < 3; ++q) {
        if (m(p, q) == 0.0) continue;
        const double half = (m(q, q) - m(p, p)) / (2.0 * m(p, q));
        const double tan = std::copysign(1.0, half) / (std::abs(half) + std::sqrt(1.0 + half * half));
        const double cos = 1.0 / std::sqrt(1.0 + tan * tan), sin = tan * cos;
        for (std::size_t k = 0; k < 3; ++k) {
          const double left = m(k, p), right = m(k, q);
          m(k, p) = cos * left - sin * right;
          m(k, q) = sin * left + cos * right;
        }
        for (std::size_t k = 0; k < 3; ++k) {
          const double left = m(p, k), right = m(q, k);
          m(p, k) = cos * left - sin * right;
          m(q, k) = sin * left + cos * right;
        }
        for (std::size_t k = 0; k < 3; ++k) {
          const double left = axes(k, p), right = axes(k, q);
          axes(k, p) = cos * left - sin * right;
          axes(k, q) = sin * left + cos * right;
        }
      }
    }
  }
  return {{m(0, 0), m(1, 1), m(2, 2)}, axes};
}

}  // namespace glass_nav
