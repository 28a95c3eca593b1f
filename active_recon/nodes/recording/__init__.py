"""What a recorder records, and what it notices while it does."""
